//! What cannot be recorded is refused before anything is written.

use std::path::Path;

use codewheel_capture::{Format, Reader, Recorder, WriteError};

use crate::bench::{can0, pb0};

#[test]
fn an_unknown_suffix_is_refused_with_those_that_are_known() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["capture.txt", "capture", "log", "capture.pcap", ""] {
        let path = folder.path().join(name);
        let error = Recorder::create(&path, vec![can0()]).unwrap_err().to_string();
        assert!(error.contains("write .log, .asc, .trc or .pcapng"), "{error}");
        assert!(!path.is_file());
        let error = Reader::open(Path::new(name)).unwrap_err().to_string();
        assert!(error.contains("write .log, .asc, .trc or .pcapng"), "{error}");
    }
}

#[test]
fn suffixes_are_known_in_capital_letters() {
    assert_eq!(Format::of(Path::new("A.ASC")), Ok(Format::Asc));
    assert_eq!(Format::of(Path::new("/tmp/a.b/C.PcapNG")), Ok(Format::Pcapng));
}

#[test]
fn asc_and_trc_refuse_profibus_and_leave_an_old_file_alone() {
    let folder = tempfile::tempdir().unwrap();
    for suffix in ["asc", "trc"] {
        let path = folder.path().join(format!("old.{suffix}"));
        std::fs::write(&path, "what was there").unwrap();
        let error = Recorder::create(&path, vec![can0(), pb0()]).unwrap_err();
        assert!(matches!(error, WriteError::Format(_)));
        assert_eq!(
            error.to_string(),
            format!(
                "a .{suffix} file carries CAN frames, and pb0 is PROFIBUS: record to .pcapng or .log"
            )
        );
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "what was there");
    }
}

#[test]
fn a_folder_that_does_not_exist_is_said_by_the_system() {
    let path = Path::new("/nowhere/at/all/capture.log");
    let error = Recorder::create(path, vec![can0()]).unwrap_err();
    assert!(matches!(error, WriteError::Io(_)), "{error}");
    assert!(Reader::open(path).unwrap_err().to_string().starts_with("the file cannot be read"));
}
