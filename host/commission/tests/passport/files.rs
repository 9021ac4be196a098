//! The file: what is written is read back, what people edit is taken, what cannot be is shown.

use codewheel_commission::passport::{
    ExpectedPacketRates, Nameplate, Passport, Position, Project, Setting, Source,
};
use codewheel_commission::{Reading, Real};
use codewheel_device::Product;
use codewheel_device::product::Bus;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

use crate::toy;

fn drive() -> Passport {
    toy::new("amg11-d29", 4_711, 100).with(&[("steps-per-turn", 3_600)]).preset_at(5).take()
}

#[test]
fn the_file_of_an_encoder_reads_like_this() {
    let mut passport = drive();
    passport.bit_rate = Some(500_000);
    let expected = r#"# The passport of an encoder: what a replacement needs to give the same positions.
# It may be edited; what cannot be is refused with its line.

format = 1
taken = "2027-01-15T08:00:00Z" # UTC
program = "codewheel test"
source = "device" # the encoder itself said it

[bus]
kind = "devicenet"
address = 5
bit-rate = 500000 # bit/s

[identity]
models = ["amg11-d29"] # what it may be, in the catalogue
vendor = 468
device-type = 0
product-code = 10 # 0Ah
revision = "1.1"
serial = 4711
product-name = "AMG 11 - Multiturn"
firmware = "1.01"
singleturn-resolution = 8192 # step: what its disc has in a turn
revolutions = 65536 # turns that it can tell apart

[settings]
direction = 0 # CW: Sense of rotation
steps-per-turn = 3600 # step: Steps per turn
total-resolution = 235929600 # step: Total resolution
cos-delta = 1 # step: COS delta

[position]
preset = 5 # step: as last written
offset = -38 # step: what the preset adds; it belongs to this unit alone
steps = 5 # where the machine stood
at-rest = true

# What the project of the master must say.
[project]
data-sheet = "AMG11D29.eds"
"#;
    assert_eq!(passport.to_toml(), expected);
}

#[test]
fn the_file_of_a_profibus_encoder_has_the_octets_and_words_of_the_project() {
    let passport = toy::new("amg11-p29", 1, 0).with(&[("total-resolution", 921_600)]).take();
    let text = passport.to_toml();
    let project = r#"
# What the project of the master must say.
[project]
data-sheet = "PB29DPV0.GSD"
# octets 10–11: Measuring units per rev. hi = 0
# octets 12–13: Measuring units per rev. lo = 8192
# octets 14–15: Total measuring range (units) hi = 14
# octets 16–17: Total measuring range (units) lo = 4096
user-parameters = [0x00, 0x0A, 0x00, 0x00, 0x20, 0x00, 0x00, 0x0E, 0x10, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00] # Set_Prm from octet 8 on
"#;
    assert!(text.ends_with(project), "{text}");
    assert_eq!(Passport::parse(&text), Ok(passport));
}

#[test]
fn what_people_edit_is_taken_with_their_comments() {
    let text = drive().to_toml();
    let text = text
        .replace(
            "steps-per-turn = 3600 # step: Steps per turn",
            "steps-per-turn=0x168  # gear 10:1",
        )
        .replace("serial = 4711\n", "")
        .replace("[position]", "# read off the scale\n[position]");
    let passport = Passport::parse(&text).unwrap();
    assert_eq!(passport.number("steps-per-turn"), Some(360));
    assert_eq!(passport.nameplate.serial, None);
    let again = Passport::parse(&passport.to_toml()).unwrap();
    assert_eq!(again, passport);
    assert!(again.to_toml().contains("steps-per-turn = 360 # gear 10:1"));
}

#[test]
fn a_parameter_of_a_stranger_may_have_a_fraction() {
    let text = drive().to_toml().replace("cos-delta = 1", "\"parameter/9\" = 0.1\ncos-delta = 1");
    let passport = Passport::parse(&text).unwrap();
    let setting = passport.settings.iter().find(|it| it.name == "parameter/9").unwrap();
    assert_eq!(setting.reading, Reading::Real(Real::Single(0.1)));
    assert!(passport.to_toml().contains("\"parameter/9\" = 0.1"), "{}", passport.to_toml());
}

/// What is said of the drive's file after an edit.
fn complaint(from: &str, to: &str) -> String {
    let text = drive().to_toml();
    assert!(text.contains(from), "{from}");
    Passport::parse(&text.replace(from, to)).expect_err("it cannot be read").to_string()
}

#[test]
fn whatever_is_wrong_is_shown_with_its_line() {
    let cases = [
        // What, into what, what is said.
        ("address = 5", "address = 5\nadress = 6", "unknown field `adress`"),
        ("vendor = 468", "vendor = \"Baumer\"", "invalid type"),
        ("cos-delta = 1", "cos-delta = 1.5", "a number, a text or octets"),
        ("cos-delta = 1", "cos-delta = [1, 300]", "300 is no octet"),
        ("cos-delta = 1", "steps-per-turn = 1", "duplicate key"),
        ("\"amg11-d29\"", "\"amg11-d30\"", "there is no model \"amg11-d30\""),
        ("format = 1", "format = 2", "format 1, not 2"),
        ("revision = \"1.1\"", "revision = \"one\"", "two numbers"),
        ("2027-01-15T08:00:00Z", "yesterday", "2026-01-31T12:00:00Z"),
        ("address = 5", "address = 200", "0 to 126"),
        ("[settings]", "[settings", "unclosed table"),
        ("kind = \"devicenet\"", "kind = \"canopen\"", "canopen"),
    ];
    let text = drive().to_toml();
    for (from, to, words) in cases {
        // The line of the edit, of two lines the second one.
        let before = text.split(from).next().unwrap_or_default();
        let line = 1 + before.matches('\n').count() + to.matches('\n').count();
        let said = complaint(from, to);
        assert!(said.contains(&format!("line {line}")), "{to}: {said}");
        assert!(said.contains(words), "{to}: {said}");
    }
}

#[test]
fn octets_that_contradict_the_settings_are_shown_with_their_line() {
    let text = toy::new("amg11-p29", 1, 0).take().to_toml();
    let line = 1 + text.lines().position(|line| line.starts_with("user-parameters")).unwrap();
    let said = Passport::parse(&text.replace("direction = 0", "direction = 1")).unwrap_err();
    let said = said.to_string();
    assert!(said.contains(&format!("line {line}")), "{said}");
    assert!(said.contains("user-parameters say direction = 0, the settings 1"), "{said}");
}

#[test]
fn what_a_foreign_device_calls_its_values_cannot_break_the_file() {
    let mut passport = drive();
    passport.settings = vec![Setting {
        name: "parameter/3\n[evil]".to_owned(),
        reading: Reading::Text("\"\n]\u{7}".to_owned()),
        note: String::new(),
    }];
    passport.nameplate.product_name = Some("'''\r\n# \"".to_owned());
    assert_eq!(Passport::parse(&passport.to_toml()), Ok(passport));
}

fn reading() -> impl Strategy<Value = Reading> {
    prop_oneof![
        any::<i64>().prop_map(Reading::Number),
        any::<String>().prop_map(Reading::Text),
        vec(any::<u8>(), 0..9).prop_map(Reading::Octets),
    ]
}

fn settings() -> impl Strategy<Value = Vec<Setting>> {
    let note = "([!-~é]([ -~é]{0,20}[!-~é])?)?".prop_filter("# begins it", |n| !n.starts_with('#'));
    let setting = (any::<String>(), reading(), note).prop_map(|(name, reading, note)| Setting {
        name,
        reading,
        note,
    });
    vec(setting, 0..8).prop_map(|mut settings: Vec<Setting>| {
        let mut seen = Vec::new();
        settings.retain(|setting| {
            let is_new = !seen.contains(&setting.name);
            seen.push(setting.name.clone());
            is_new
        });
        settings
    })
}

prop_compose! {
    fn nameplate()(
        models in vec(0_usize..23, 0..3),
        vendor in any::<Option<u16>>(),
        device_type in any::<Option<u16>>(),
        product_code in any::<Option<u16>>(),
        revision in any::<Option<(u8, u8)>>(),
        serial in any::<Option<u32>>(),
        texts in any::<(Option<String>, Option<String>)>(),
        disc in any::<(Option<u32>, Option<u32>)>(),
    ) -> Nameplate {
        Nameplate {
            models: models.into_iter().map(|place| Product::all().nth(place).unwrap()).collect(),
            vendor, device_type, product_code, revision, serial,
            product_name: texts.0, firmware: texts.1,
            singleturn_resolution: disc.0, revolutions: disc.1,
        }
    }
}

prop_compose! {
    fn project()(
        data_sheet in any::<Option<String>>(),
        user_parameters in option::of(vec(any::<u8>(), 0..20)),
        configuration in option::of(vec(any::<u8>(), 0..4)),
        allocation in vec(any::<String>(), 0..3),
        rates in any::<(Option<u16>, Option<u16>, Option<u16>)>(),
    ) -> Project {
        Project {
            data_sheet, user_parameters, configuration, allocation,
            expected_packet_rates: ExpectedPacketRates {
                explicit: rates.0, poll: rates.1, change_of_state: rates.2,
            },
        }
    }
}

prop_compose! {
    fn passport()(
        seconds in -60_000_000_000_i64..250_000_000_000,
        program in any::<String>(),
        from_capture in any::<bool>(),
        absent in vec(any::<String>(), 0..4),
        on_profibus in any::<bool>(),
        address in 0..=126_u8,
        bit_rate in any::<Option<u32>>(),
        nameplate in nameplate(),
        settings in settings(),
        position in any::<(Option<i64>, Option<i64>, Option<u32>, Option<bool>)>(),
        project in project(),
    ) -> Passport {
        let mut passport = drive();
        passport.taken = passport.taken.checked_add(jiff::SignedDuration::from_secs(seconds - 1_800_000_000))
            .unwrap_or(passport.taken);
        passport.program = program;
        passport.source = if from_capture { Source::Capture } else { Source::Device };
        passport.absent = absent;
        passport.bus = if on_profibus { Bus::Profibus } else { Bus::DeviceNet };
        passport.address = address;
        passport.bit_rate = bit_rate;
        passport.nameplate = nameplate;
        passport.settings = settings;
        passport.position = Position {
            preset: position.0, offset: position.1, steps: position.2, at_rest: position.3,
        };
        passport.project = project;
        passport
    }
}

proptest! {
    #[test]
    fn whatever_is_written_is_read_back(passport in passport()) {
        let text = passport.to_toml();
        prop_assert_eq!(Passport::parse(&text), Ok(passport), "{}", text);
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in any::<String>(), cut in 0_usize..900) {
        let _ = Passport::parse(&text);
        let whole = drive().to_toml();
        let front: String = whole.chars().take(cut).collect();
        let _ = Passport::parse(&format!("{front}{text}"));
    }
}
