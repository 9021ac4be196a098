//! Set_Prm and Global_Control (EN 50170-2, DP; PROFIBUS manual §6.1).

use codewheel_device::profibus::parameters::{FIRST_USER_OCTET, Field, RESERVED, ROWS};

use super::super::line::Line;

const STATION_STATUS: &[(u8, &str)] =
    &[(3, "WD_On"), (4, "Freeze_Req"), (5, "Sync_Req"), (6, "Unlock_Req"), (7, "Lock_Req")];
const WATCHDOG_ON: u8 = 1 << 3;
/// Octet 8, DPV1_Status_1.
const WATCHDOG_BASE_1_MS: u8 = 1 << 2;
const OCTET_8: &[(u8, &str)] =
    &[(2, "WD_Base_1ms"), (5, "Publisher_Enable"), (6, "Fail_Safe"), (7, "DPV1_Enable")];
const CONTROL_COMMANDS: &[(u8, &str)] =
    &[(1, "Clear_Data"), (2, "Unfreeze"), (3, "Freeze"), (4, "Unsync"), (5, "Sync")];

pub(super) fn tell(data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    let &[status, factor_1, factor_2, delay, ident_high, ident_low, group, ref user @ ..] = data
    else {
        line.octets("data", "data", data);
        return line.note(&["too short"]);
    };
    line.bits("station-status", "station status", status.into(), STATION_STATUS);
    if status & WATCHDOG_ON != 0 {
        let base =
            if user.first().is_some_and(|octet| octet & WATCHDOG_BASE_1_MS != 0) { 1 } else { 10 };
        let time = i64::from(factor_1) * i64::from(factor_2) * base;
        line.number("watchdog", "T_WD", time, "ms");
    }
    line.number("min-t-sdr", "min T_SDR", delay.into(), "bit");
    line.hex("ident-number", "ident number", &[ident_high, ident_low]);
    line.hex("group", "group", &[group]);
    let Some((octet_8, _)) = user.split_first() else { return };
    if !is_encoder {
        return line.octets("user-parameters", "user parameters", user);
    }
    line.bits("octet-8", "octet 8", (*octet_8).into(), OCTET_8);
    for row in ROWS {
        let Some(value) = row.read(user) else { continue };
        let word = usize::try_from(value).ok().and_then(|value| row.values.get(value));
        match word {
            Some(word) => line.word(row.key, row.name, word.as_bytes()),
            None => line.number(row.key, row.name, value.into(), row.unit),
        }
    }
    // What no row names is shown where it says anything.
    let operating = user.get(1).copied().unwrap_or_default();
    let named = ROWS.into_iter().fold(0, |bits: u8, row| match row.field {
        Field::Bit(bit) => bits | 1 << bit,
        Field::Unsigned32 { .. } => bits,
    });
    if operating & !named != 0 {
        line.bits("octet-9-reserved", "octet 9, reserved", (operating & !named).into(), &[]);
    }
    let shown = ROWS
        .into_iter()
        .filter(|row| row.read(user).is_some())
        .map(|row| usize::from(row.octets.last - FIRST_USER_OCTET) + 1)
        .max()
        .unwrap_or(1);
    let rest = user.get(shown..).unwrap_or_default();
    let is_reserved = shown == usize::from(RESERVED.first - FIRST_USER_OCTET);
    if !(is_reserved && rest.iter().all(|octet| *octet == 0)) {
        line.octets("rest", "rest", rest);
    }
}

pub(super) fn global_control(data: &[u8], line: &mut Line<'_>) {
    let [command, group, rest @ ..] = data else {
        line.octets("data", "data", data);
        return line.note(&["too short"]);
    };
    line.bits("command", "", (*command).into(), CONTROL_COMMANDS);
    line.hex("group", "group", &[*group]);
    line.octets("rest", "rest", rest);
}
