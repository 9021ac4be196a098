//! Any record whatever, as octets.

use codewheel_encoder::{Block, Direction, Kept, Reference, Settings};
use codewheel_station::Reader;

/// Any record of the product with `fingerprint`: flags (bit 0 scaling, 1 counter-clockwise, 2 with a
/// reference), n, T, preset, offset u32, k₀ i64, COS delta u32, k i64, r u32, 24 octets of the bus.
pub(crate) fn any_record(reader: &mut Reader<'_>, fingerprint: u16) -> Kept {
    let flags = reader.u8().unwrap_or_default();
    let direction = if flags & 2 == 0 { Direction::Cw } else { Direction::Ccw };
    let settings = Settings {
        direction,
        steps_per_turn: reader.u32_le().unwrap_or_default(),
        total_resolution: reader.u32_le().unwrap_or_default(),
        scaling: flags & 1 != 0,
    };
    let saved = Block {
        settings,
        preset: reader.u32_le().unwrap_or_default(),
        offset: reader.u32_le().unwrap_or_default().cast_signed(),
        crossings_at_change: reader.u64_le().unwrap_or_default().cast_signed(),
        cos_delta: reader.u32_le().unwrap_or_default(),
    };
    let crossings = reader.u64_le().unwrap_or_default().cast_signed();
    let reference = Reference { crossings, code: reader.u32_le().unwrap_or_default() };
    Kept {
        fingerprint,
        saved,
        reference: (flags & 4 != 0).then_some(reference),
        serial: 7,
        writes: u32::MAX - 2,
        bus: reader.array().unwrap_or_default(),
    }
}
