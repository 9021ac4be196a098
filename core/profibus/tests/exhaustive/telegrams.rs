//! The telegrams of a bring-up: what the tables of damage are about.

use codewheel_profibus::telegram::Telegram;

pub(crate) struct Sample {
    pub(crate) name: &'static str,
    pub(crate) octets: Vec<u8>,
}

fn sample(name: &'static str, hex: &str) -> Sample {
    let octets: Vec<_> = hex
        .split_whitespace()
        .map(|octet| u8::from_str_radix(octet, 16).expect("a hexadecimal octet"))
        .collect();
    let telegram = Telegram::decode(&octets).expect("undamaged").expect("whole");
    assert_eq!(telegram.length(), octets.len(), "{name}");
    Sample { name, octets }
}

pub(crate) const SHORT: &str = "SD1, FDL status";
pub(crate) const EXCHANGE: &str = "Data_Exchange F1h request";
pub(crate) const DIAGNOSIS: &str = "Slave_Diag answer, 57 octets";
pub(crate) const TOKEN: &str = "SD4, token";
pub(crate) const ACKNOWLEDGE: &str = "SC";

pub(crate) fn all() -> Vec<Sample> {
    let zeros = "00 00 00 00 00 00 00 00";
    let stars = "2A 2A 2A 2A 2A 2A 2A 2A 2A 2A";
    let diagnosis = format!(
        "68 3E 3E 68 82 87 08 3E 3C 02 05 00 FF 05 9B 33 00 0A 01 00 00 20 00 FF FF 00 00 01 00 00 \
         00 00 01 10 01 21 FF FF FF FF {zeros} 00 00 20 00 20 00 00 00 {stars} A1 16"
    );
    vec![
        sample(ACKNOWLEDGE, "E5"),
        sample(TOKEN, "DC 02 02"),
        sample(SHORT, "10 07 02 49 52 16"),
        sample(EXCHANGE, "68 07 07 68 07 02 7D 00 00 00 00 86 16"),
        sample(DIAGNOSIS, &diagnosis),
        sample("FDL status answer", "10 02 07 00 09 16"),
        sample("Slave_Diag request", "68 05 05 68 87 82 6C 3C 3E EF 16"),
        sample(
            "Set_Prm",
            "68 16 16 68 87 82 5C 3D 3E B8 01 14 0B 05 9B 00 00 0A 00 00 20 00 20 00 00 00 A2 16",
        ),
        sample("Chk_Cfg", "68 06 06 68 87 82 7C 3E 3E F1 F2 16"),
        sample("Data_Exchange F1h answer", "68 07 07 68 02 07 08 00 00 00 00 11 16"),
        sample("RS", "10 02 07 03 0C 16"),
        sample("Global_Control Sync", "68 07 07 68 FF 82 46 3A 3E 20 00 5F 16"),
        sample("SD3", "A2 07 02 7D 01 02 03 04 05 06 07 08 AA 16"),
    ]
}

/// Whether a receiver takes these octets, or the first of them, for a telegram other than `original`.
pub(crate) fn is_mistaken(octets: &[u8], original: &[u8]) -> bool {
    match Telegram::decode(octets) {
        Ok(Some(telegram)) => octets[..telegram.length()] != *original,
        Ok(None) | Err(_) => false,
    }
}
