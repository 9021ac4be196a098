//! Our PB13DPV0.GSD against what the vendor's own says, keyword for keyword.

use std::fmt::Write;

use codewheel_datasheet::sheet_for;
use codewheel_device::Product;

use crate::every_file::{is_kept, kept_at};
use crate::gsd_reader::{Facts, facts};

/// What the vendor's file for 13 bits says, numbers in decimal.
const VENDOR: &[(&str, &str)] = &[
    ("Vendor_Name", "\"Baumer group\""),
    ("Model_Name", "\"xMG_HEAG\""),
    ("Revision", "\"1.00\""),
    ("Ident_Number", "1435"),
    ("PrmText 1 Text(0)", "\"Clockwise (CW)\""),
    ("PrmText 1 Text(1)", "\"Counterclockwise (CCW)\""),
    ("PrmText 2 Text(0)", "\"Disable\""),
    ("PrmText 2 Text(1)", "\"Enable\""),
    ("PrmText 3 Text(0)", "\"No\""),
    ("PrmText 3 Text(1)", "\"Yes\""),
    ("PrmText 4 Text(0)", "\"Disable Scaling\""),
    ("PrmText 4 Text(1)", "\"Enable Scaling\""),
    ("ExtUserPrmData 1", "\"Code sequence\""),
    ("ExtUserPrmData 1 type", "Bit(0) 0 0-1"),
    ("ExtUserPrmData 1 Prm_Text_Ref", "1"),
    ("ExtUserPrmData 2", "\"Class 2 functionality\""),
    ("ExtUserPrmData 2 type", "Bit(1) 1 0-1"),
    ("ExtUserPrmData 2 Prm_Text_Ref", "2"),
    ("ExtUserPrmData 3", "\"Commissioning diagnostics\""),
    ("ExtUserPrmData 3 type", "Bit(2) 0 0-1"),
    ("ExtUserPrmData 3 Prm_Text_Ref", "3"),
    ("ExtUserPrmData 4", "\"Scaling function control\""),
    ("ExtUserPrmData 4 type", "Bit(3) 1 0-1"),
    ("ExtUserPrmData 4 Prm_Text_Ref", "4"),
    ("ExtUserPrmData 5", "\"Measuring units per rev. hi\""),
    ("ExtUserPrmData 5 type", "Unsigned16 0 0-0"),
    ("ExtUserPrmData 6", "\"Measuring units per rev. lo\""),
    ("ExtUserPrmData 6 type", "Unsigned16 8192 1-8192"),
    ("ExtUserPrmData 7", "\"Total measuring range(units)hi\""),
    ("ExtUserPrmData 7 type", "Unsigned16 0 0-0"),
    ("ExtUserPrmData 8", "\"Total measuring range(units)lo\""),
    ("ExtUserPrmData 8 type", "Unsigned16 8192 1-8192"),
    ("Protocol_Ident", "0"),
    ("Station_Type", "0"),
    ("FMS_supp", "0"),
    ("Hardware_Release", "\"V1.0\""),
    ("Software_Release", "\"V1.0\""),
    ("DP_Encoder_class", "2"),
    ("DP_Encoder_profile_version", "1.1"),
    ("DP_Encoder_manufacturer_specific_functions", "0"),
    ("9.6_supp", "1"),
    ("19.2_supp", "1"),
    ("93.75_supp", "1"),
    ("187.5_supp", "1"),
    ("500_supp", "1"),
    ("1.5M_supp", "1"),
    ("3M_supp", "1"),
    ("6M_supp", "1"),
    ("12M_supp", "1"),
    ("MaxTsdr_9.6", "60"),
    ("MaxTsdr_19.2", "60"),
    ("maxTsdr_93.75", "60"),
    ("MaxTsdr_187.5", "60"),
    ("MaxTsdr_500", "100"),
    ("MaxTsdr_1.5M", "150"),
    ("MaxTsdr_3M", "250"),
    ("MaxTsdr_6M", "450"),
    ("MaxTsdr_12M", "800"),
    ("Redundancy", "0"),
    ("Repeater_Ctrl_Sig", "0"),
    ("24V_Pins", "0"),
    ("Freeze_Mode_supp", "1"),
    ("Sync_Mode_supp", "1"),
    ("Auto_Baud_supp", "1"),
    ("Set_Slave_Add_supp", "0"),
    ("User_Prm_Data_Len", "18"),
    ("User_Prm_Data", "0,10,0,0,32,0,0,0,32,0,0,0,0,0,0,0,0,0"),
    ("Ext_User_Prm_Data_Ref(1)", "1,2,3,4"),
    ("Ext_User_Prm_Data_Ref(2)", "5"),
    ("Ext_User_Prm_Data_Ref(4)", "6"),
    ("Ext_User_Prm_Data_Ref(6)", "7"),
    ("Ext_User_Prm_Data_Ref(8)", "8"),
    ("Min_Slave_Intervall", "1"),
    ("Modular_Station", "1"),
    ("Max_Module", "1"),
    ("Slave_Family", "7"),
    ("Max_Input_Len", "2"),
    ("Max_Output_Len", "2"),
    ("Max_Data_len", "4"),
    ("Max_Diag_Data_Len", "59"),
    ("Module 0xF0", "\"16 Bit Class 2 Encoder \""),
    ("Module 0xD0", "\"16 Bit Class 1 Encoder \""),
];

/// A keyword, the vendor's value, ours; [`NONE`] where there is none.
type Difference = (&'static str, &'static str, &'static str);

/// Why ours differs, and where.
const DIFFERENCES: &[(&str, &[Difference])] = &[
    (
        "Tools of GSD revision 0 and later ones send the same 18 octets: what `User_Prm_Data` says stands \
         there twice.",
        &[
            ("GSD_Revision", "-", "1"),
            ("Max_User_Prm_Data_Len", "-", "18"),
            ("Ext_User_Prm_Data_Const(0)", "-", "0,10,0,0,32,0,0,0,32,0,0,0,0,0,0,0,0,0"),
        ],
    ),
    (
        "All four configurations of the manual (§6.2) are possible on every product.",
        &[
            ("Module 0xD1", "-", "\"32 bit position\""),
            ("Module 0xF1", "-", "\"32 bit position and preset\""),
            ("Max_Input_Len", "2", "4"),
            ("Max_Output_Len", "2", "4"),
        ],
    ),
    (
        "Two keywords are spelled as the specification has them. With four configurations there are up to \
         8 octets of data.",
        &[
            ("maxTsdr_93.75", "60", "-"),
            ("MaxTsdr_93.75", "-", "60"),
            ("Max_Data_len", "4", "-"),
            ("Max_Data_Len", "-", "8"),
        ],
    ),
    (
        "The devices know this rate as well.",
        &[("45.45_supp", "-", "1"), ("MaxTsdr_45.45", "-", "60")],
    ),
    (
        "The three files have one ident number, so the name tells them apart in a catalogue.",
        &[("Model_Name", "\"xMG_HEAG\"", "\"xMG_HEAG 13 bit\"")],
    ),
    (
        "Our own texts, the same as everywhere else in the program.",
        &[
            ("PrmText 1 Text(0)", "\"Clockwise (CW)\"", "\"CW\""),
            ("PrmText 1 Text(1)", "\"Counterclockwise (CCW)\"", "\"CCW\""),
            ("PrmText 2 Text(0)", "\"Disable\"", "\"OFF\""),
            ("PrmText 2 Text(1)", "\"Enable\"", "\"ON\""),
            ("PrmText 3 Text(0)", "\"No\"", "-"),
            ("PrmText 3 Text(1)", "\"Yes\"", "-"),
            ("PrmText 4 Text(0)", "\"Disable Scaling\"", "-"),
            ("PrmText 4 Text(1)", "\"Enable Scaling\"", "-"),
            ("ExtUserPrmData 3 Prm_Text_Ref", "3", "2"),
            ("ExtUserPrmData 4 Prm_Text_Ref", "4", "2"),
            ("ExtUserPrmData 1", "\"Code sequence\"", "\"Sense of rotation\""),
            ("ExtUserPrmData 4", "\"Scaling function control\"", "\"Scaling function\""),
            (
                "ExtUserPrmData 7",
                "\"Total measuring range(units)hi\"",
                "\"Total measuring range (units) hi\"",
            ),
            (
                "ExtUserPrmData 8",
                "\"Total measuring range(units)lo\"",
                "\"Total measuring range (units) lo\"",
            ),
            ("Module 0xF0", "\"16 Bit Class 2 Encoder \"", "\"16 bit position and preset\""),
            ("Module 0xD0", "\"16 Bit Class 1 Encoder \"", "\"16 bit position\""),
        ],
    ),
];

const NONE: &str = "-";

const BOOK_HEAD: &str = "\
# Where our GSD files differ from the vendor's

`codewheel gsd amg11-p13` writes a PB13DPV0.GSD that says what the vendor's own file of that name says, with these
exceptions. Numbers are decimal, `–` is a keyword that is not there. A test holds this page and the file together. The
vendor's files for 18 and 29 bits were not at hand; ours follow the manual (§4).
";

const BOOK_END: &str = "
Some things are as the vendor has them though the device could say more or less: `Max_Diag_Data_Len` is 59 where 57
octets are the most that is sent, and both releases are V1.0 where the diagnosis tells software 1.21.

Where the high word of a number can be more than 0 the low word has no limit of its own, so a tool lets people enter
a range that is too large, or 0; the encoder refuses it then (parameterization error).
";

fn ours() -> Facts {
    facts(&sheet_for(Product::find("amg11-p13").expect("a model of the catalogue")).text)
}

fn vendors() -> Facts {
    VENDOR.iter().map(|(keyword, value)| ((*keyword).to_owned(), (*value).to_owned())).collect()
}

fn value<'a>(facts: &'a Facts, keyword: &str) -> &'a str {
    facts.get(keyword).map_or(NONE, String::as_str)
}

#[test]
fn every_difference_from_the_vendors_file_is_in_the_list_and_no_other() {
    let (vendors, ours) = (vendors(), ours());
    assert_eq!(vendors.len(), VENDOR.len(), "a keyword stands there twice");
    let mut listed: Vec<_> = DIFFERENCES.iter().flat_map(|(_, list)| *list).copied().collect();
    listed.sort_unstable();
    let mut keywords: Vec<_> = vendors.keys().chain(ours.keys()).map(String::as_str).collect();
    keywords.sort_unstable();
    keywords.dedup();
    let found: Vec<_> = keywords
        .into_iter()
        .map(|keyword| (keyword, value(&vendors, keyword), value(&ours, keyword)))
        .filter(|(_, vendor, own)| vendor != own)
        .collect();
    assert_eq!(found, listed);
}

#[test]
fn the_list_is_told_in_the_book() {
    let mut book = BOOK_HEAD.to_owned();
    for (reason, list) in DIFFERENCES {
        let _ = writeln!(book, "\n{reason}\n\n| keyword | vendor | here |\n|---|---|---|");
        for (keyword, vendor, own) in *list {
            let [vendor, own] = [vendor, own].map(|value| match *value {
                NONE => "–".to_owned(),
                value => format!("`{value}`"),
            });
            let _ = writeln!(book, "| `{keyword}` | {vendor} | {own} |");
        }
    }
    book.push_str(BOOK_END);
    is_kept(&kept_at("../../docs/gsd-differences.md"), &book);
}
