//! Set_Prm, as far as the standard defines it: octets 1 to 8.

use codewheel_station::Duration;

use crate::ParameterFault;

/// Bits of octet 1, station status.
mod status {
    pub(super) const LOCK: u8 = 0x80;
    pub(super) const UNLOCK: u8 = 0x40;
    pub(super) const SYNC: u8 = 0x20;
    pub(super) const FREEZE: u8 = 0x10;
    pub(super) const WATCHDOG: u8 = 0x08;
    pub(super) const RESERVED: u8 = 0x07;
}

/// Bit of octet 8: the watchdog counts milliseconds, not tens of them.
const WATCHDOG_BASE_1_MS: u8 = 0x04;
/// Bits of octet 8: DP-V1, fail-safe, publisher.
const NOT_SUPPORTED: u8 = 0xE0;
/// Bits of octet 8 that mean nothing.
const RESERVED: u8 = 0x18;

/// What a Set_Prm wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SetParameters<'a> {
    /// Neither Lock nor Unlock: the station delay alone, where it is given.
    StationDelay(Option<u8>),
    /// Unlock, with or without Lock.
    Unlock,
    /// Lock: all of it.
    Lock(Parameters<'a>),
}

/// The parameters of a master that locks the slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Parameters<'a> {
    /// T_WD; `None` with the watchdog off.
    pub(crate) watchdog: Option<Duration>,
    /// Min T_SDR in bits; `None` to keep it.
    pub(crate) station_delay: Option<u8>,
    /// Sync_Req: the master may command Sync.
    pub(crate) sync: bool,
    /// Freeze_Req: the master may command Freeze.
    pub(crate) freeze: bool,
    /// Group_Ident: a bit for each group the slave belongs to.
    pub(crate) groups: u8,
    /// The reserved bits of station status that are set; they mean nothing.
    pub(crate) reserved: u8,
    /// Those of octet 8.
    pub(crate) reserved_operating: u8,
    /// Octets 8 and up.
    pub(crate) user: &'a [u8],
}

/// Whether octet 8 asks for what a DP-V0 slave has not, whatever else is wrong.
pub(crate) fn asks_for_more(octets: &[u8]) -> bool {
    octets.get(7).is_some_and(|operating| operating & NOT_SUPPORTED != 0)
}

impl<'a> SetParameters<'a> {
    /// Reads the octets of a Set_Prm for a slave with `ident_number`.
    pub(crate) fn read(octets: &'a [u8], ident_number: u16) -> Result<Self, ParameterFault> {
        let [station_status, first, second, delay, ident @ .., groups] =
            octets.first_chunk::<7>().ok_or_else(|| ParameterFault::Short {
                octets: u8::try_from(octets.len()).unwrap_or(u8::MAX),
            })?;
        let has = |bit| station_status & bit != 0;
        let station_delay = Some(*delay).filter(|bits| *bits > 0);
        match (has(status::LOCK), has(status::UNLOCK)) {
            (_, true) => return Ok(Self::Unlock),
            (false, false) => return Ok(Self::StationDelay(station_delay)),
            (true, false) => {}
        }
        let user = octets.get(7..).unwrap_or_default();
        let operating = user.first().copied().unwrap_or_default();
        if has(status::WATCHDOG) && (*first == 0 || *second == 0) {
            return Err(ParameterFault::WatchdogFactor { factors: [*first, *second] });
        }
        let given = u16::from_be_bytes(*ident);
        if given != ident_number {
            return Err(ParameterFault::IdentNumber { given, own: ident_number });
        }
        if operating & NOT_SUPPORTED != 0 {
            return Err(ParameterFault::NotSupported { octet: operating });
        }
        let base = if operating & WATCHDOG_BASE_1_MS != 0 { 1 } else { 10 };
        let watchdog = Duration::from_millis(u64::from(*first) * u64::from(*second) * base);
        Ok(Self::Lock(Parameters {
            watchdog: has(status::WATCHDOG).then_some(watchdog),
            station_delay,
            sync: has(status::SYNC),
            freeze: has(status::FREEZE),
            groups: *groups,
            reserved: station_status & status::RESERVED,
            reserved_operating: operating & RESERVED,
            user,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: [u8; 10] = [0xB8, 1, 20, 11, 0x05, 0x9B, 3, 0, 0x0A, 0];

    fn read(octets: &[u8]) -> Result<SetParameters<'_>, ParameterFault> {
        SetParameters::read(octets, 0x059B)
    }

    fn with(place: usize, octet: u8) -> [u8; 10] {
        let mut octets = GOOD;
        octets[place] = octet;
        octets
    }

    fn locked(octets: &[u8]) -> Parameters<'_> {
        match read(octets) {
            Ok(SetParameters::Lock(parameters)) => parameters,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn each_octet_is_read_where_the_standard_puts_it() {
        let expected = Parameters {
            watchdog: Some(Duration::from_millis(200)),
            station_delay: Some(11),
            sync: true,
            freeze: true,
            groups: 3,
            reserved: 0,
            reserved_operating: 0,
            user: &GOOD[7..],
        };
        assert_eq!(locked(&GOOD), expected);
        assert_eq!(
            locked(&with(0, 0x87)),
            Parameters { watchdog: None, sync: false, freeze: false, reserved: 7, ..expected }
        );
        assert_eq!(locked(&with(3, 0)).station_delay, None);
        let short = Parameters { user: &[], ..expected };
        assert_eq!(locked(&GOOD[..7]), short, "the shortest form");
    }

    #[test]
    fn the_watchdog_counts_ten_milliseconds_or_one() {
        let watchdog = |octets: &[u8]| locked(octets).watchdog;
        assert_eq!(watchdog(&with(7, 4)), Some(Duration::from_millis(20)));
        assert_eq!(watchdog(&with(7, 7)), Some(Duration::from_millis(20)), "bits 0 and 1 as well");
        let longest = [0xB8, 255, 255, 0, 0x05, 0x9B, 0];
        assert_eq!(watchdog(&longest), Some(Duration::from_millis(650_250)));
    }

    #[test]
    fn what_is_wrong_is_said() {
        for octets in 0..7 {
            let fault = ParameterFault::Short { octets: octets as u8 };
            assert_eq!(read(&GOOD[..octets]), Err(fault));
        }
        let factors = |first, second| ParameterFault::WatchdogFactor { factors: [first, second] };
        assert_eq!(read(&with(1, 0)), Err(factors(0, 20)));
        assert_eq!(read(&with(2, 0)), Err(factors(1, 0)));
        let ident = ParameterFault::IdentNumber { given: 0x059C, own: 0x059B };
        assert_eq!(read(&with(5, 0x9C)), Err(ident));
        for octet in [0x80, 0x40, 0x20, 0xE4] {
            assert_eq!(read(&with(7, octet)), Err(ParameterFault::NotSupported { octet }));
        }
        assert_eq!(locked(&with(7, 0x1B)).reserved_operating, 0x18);
    }

    #[test]
    fn without_lock_nothing_but_the_station_delay_is_looked_at() {
        let nonsense = [0x38, 0, 0, 20, 0xFF, 0xFF, 0, 0xFF];
        assert_eq!(read(&nonsense), Ok(SetParameters::StationDelay(Some(20))));
        for status in [0x78, 0xF8] {
            let mut unlock = nonsense;
            unlock[0] = status;
            assert_eq!(read(&unlock), Ok(SetParameters::Unlock));
        }
    }
}
