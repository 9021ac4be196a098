//! Whether something happens, drawn from a seed.

use fastrand::Rng;

/// Whether something with this probability happens. Certain outcomes draw nothing, so a wire
/// without faults runs the same whatever its seed.
pub(crate) fn happens(random: &mut Rng, probability: f64) -> bool {
    probability >= 1.0 || probability > 0.0 && random.f64() < probability
}
