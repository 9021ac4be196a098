//! Slave_Diag (EN 50170-2, DP; PROFIBUS manual §7).

use codewheel_device::profibus::diagnosis::{DataType, FIRST_OCTET, ROWS, Row};

use super::super::line::Line;

const STATUS_1: &[(u8, &str)] = &[
    (0, "Station_Non_Existent"),
    (1, "Station_Not_Ready"),
    (2, "Cfg_Fault"),
    (3, "Ext_Diag"),
    (4, "Not_Supported"),
    (5, "Invalid_Slave_Response"),
    (6, "Prm_Fault"),
    (7, "Master_Lock"),
];
/// Bit 2 of octet 2 is always 1 and says nothing.
const ALWAYS: u8 = 1 << 2;
const STATUS_2: &[(u8, &str)] = &[
    (0, "Prm_Req"),
    (1, "Stat_Diag"),
    (3, "WD_On"),
    (4, "Freeze_Mode"),
    (5, "Sync_Mode"),
    (7, "Deactivated"),
];
const STATUS_3: &[(u8, &str)] = &[(7, "Ext_Diag_Overflow")];
const NO_MASTER: u8 = 0xFF;

pub(super) fn tell(data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    let &[first, second, third, master, ident_high, ident_low, ref extended @ ..] = data else {
        line.octets("data", "data", data);
        return line.note(&["too short"]);
    };
    let always = if second & ALWAYS == 0 { "without bit 2 of octet 2" } else { "" };
    line.bits("status-1", "", first.into(), STATUS_1);
    line.bits("status-2", "", (second & !ALWAYS).into(), STATUS_2);
    if third != 0 {
        line.bits("status-3", "", third.into(), STATUS_3);
    }
    match master {
        NO_MASTER => line.word("master", "master", b"none"),
        master => line.number("master", "master", master.into(), ""),
    }
    line.hex("ident-number", "ident number", &[ident_high, ident_low]);
    if is_encoder {
        let mut shown = usize::from(FIRST_OCTET) - 1;
        for row in &ROWS {
            // They follow each other without a gap.
            let Some(octets) = row.octets.of(data, 1) else { break };
            value(row, octets, data, line);
            shown = usize::from(row.octets.last);
        }
        line.octets("rest", "rest", data.get(shown..).unwrap_or_default());
    } else {
        line.octets("extended-diagnosis", "extended diagnosis", extended);
    }
    if !always.is_empty() {
        line.note(&[always]);
    }
}

fn value(row: &Row, octets: &[u8], diagnosis: &[u8], line: &mut Line<'_>) {
    let Some(number) = row.number_in(diagnosis) else {
        return line.word(row.key, row.name, octets);
    };
    match row.data_type {
        DataType::Bits => {
            let mut names = [(0, ""); 8];
            for (to, from) in names.iter_mut().zip(row.bits) {
                *to = (from.bit, from.name);
            }
            let names = names.get(..row.bits.len()).unwrap_or_default();
            line.bits(row.key, row.name, number.cast_unsigned(), names);
        }
        DataType::Version => {
            line.hex(row.key, row.name, octets);
        }
        DataType::Unsigned | DataType::Signed | DataType::Text => {
            line.number(row.key, row.name, number, row.unit);
        }
    }
}
