//! The places of stations that share one port.

/// Stations on their places; an empty place is a station without power.
#[derive(Debug)]
pub(crate) struct Seats<T>(Vec<Option<T>>);

impl<T> Seats<T> {
    pub(crate) const fn new() -> Self {
        Self(Vec::new())
    }

    pub(crate) fn put(&mut self, place: usize, seat: T) {
        if self.0.len() <= place {
            self.0.resize_with(place + 1, || None);
        }
        self.0[place] = Some(seat);
    }

    pub(crate) fn take(&mut self, place: usize) -> Option<T> {
        self.0.get_mut(place)?.take()
    }

    pub(crate) fn get(&self, place: usize) -> Option<&T> {
        self.0.get(place)?.as_ref()
    }

    pub(crate) fn get_mut(&mut self, place: usize) -> Option<&mut T> {
        self.0.get_mut(place)?.as_mut()
    }

    /// Those that are taken.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &T> {
        self.0.iter().flatten()
    }

    /// Those that are taken, with their places.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (usize, &mut T)> {
        self.0.iter_mut().enumerate().filter_map(|(place, seat)| Some((place, seat.as_mut()?)))
    }
}
