//! Explicit messages: header, services, status codes and object paths (CIP volume 3, chapter 4).
//!
//! ```text
//! request   [frag|XID|MAC] [service]        [class] [instance] [attribute] data…
//! response  [frag|XID|MAC] [service | 80h]  data…
//! error     [frag|XID|MAC] [94h]            [general status] [additional code]
//! ```
//! Body format 8/8: class and instance are one octet each.

use core::fmt;

use codewheel_station::can::Frame;

use crate::MacId;

/// The first octet of every explicit message, as on the wire; every value is a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header(pub u8);

impl Header {
    const FRAGMENTED: u8 = 1 << 7;
    const TRANSACTION: u8 = 1 << 6;

    /// Bit 7: the second octet is a fragmentation octet.
    #[must_use]
    pub const fn fragmented(self) -> bool {
        self.0 & Self::FRAGMENTED != 0
    }

    /// Bit 6: the transaction identifier, echoed in the response.
    #[must_use]
    pub const fn transaction(self) -> bool {
        self.0 & Self::TRANSACTION != 0
    }

    /// Bits 5 … 0: in a request to a Group 2 Only Server the master, echoed in the response.
    #[must_use]
    pub const fn mac(self) -> MacId {
        MacId::from_low_bits(self.0 as u16)
    }

    /// The same header with the fragmentation bit as given.
    #[must_use]
    pub const fn with_fragmented(self, fragmented: bool) -> Self {
        let rest = self.0 & !Self::FRAGMENTED;
        Self(if fragmented { rest | Self::FRAGMENTED } else { rest })
    }

    /// The same header with the other transaction identifier, for the next request.
    #[must_use]
    pub const fn of_next_transaction(self) -> Self {
        Self(self.0 ^ Self::TRANSACTION)
    }
}

/// How class and instance lie in requests over an explicit connection, as the slave says when it
/// opens it (CIP volume 3, chapter 4). The unconnected port is always 8/8.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BodyFormat {
    /// 0: both in one octet.
    #[default]
    Class8Instance8,
    /// 1: the instance in two octets.
    Class8Instance16,
    /// 2: both in two octets.
    Class16Instance16,
    /// 3: the class in two octets.
    Class16Instance8,
}

impl BodyFormat {
    /// The format with this number; `None` for one that is none of these, such as paths (4).
    #[must_use]
    pub const fn from_octet(octet: u8) -> Option<Self> {
        Some(match octet {
            0 => Self::Class8Instance8,
            1 => Self::Class8Instance16,
            2 => Self::Class16Instance16,
            3 => Self::Class16Instance8,
            _ => return None,
        })
    }

    /// Whether a class, and whether an instance, has a high octet.
    pub(crate) const fn high_octets(self) -> (bool, bool) {
        match self {
            Self::Class8Instance8 => (false, false),
            Self::Class8Instance16 => (false, true),
            Self::Class16Instance16 => (true, true),
            Self::Class16Instance8 => (true, false),
        }
    }
}

/// A service code, 00 … 7F in requests. Unknown codes survive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Service(pub u8);

impl Service {
    /// Get_Attributes_All.
    pub const GET_ATTRIBUTES_ALL: Self = Self(0x01);
    /// Reset.
    pub const RESET: Self = Self(0x05);
    /// Apply_Attributes.
    pub const APPLY_ATTRIBUTES: Self = Self(0x0D);
    /// Get_Attribute_Single.
    pub const GET_ATTRIBUTE_SINGLE: Self = Self(0x0E);
    /// Set_Attribute_Single.
    pub const SET_ATTRIBUTE_SINGLE: Self = Self(0x10);
    /// The service code of an error response; on the wire 94h.
    pub const ERROR: Self = Self(0x14);
    /// Restore.
    pub const RESTORE: Self = Self(0x15);
    /// Save.
    pub const SAVE: Self = Self(0x16);
    /// Get_Enum_String, on class 0F; the same code as Allocate on class 03.
    pub const GET_ENUM_STRING: Self = Self(0x4B);
    /// Allocate_Master/Slave_Connection_Set, on class 03.
    pub const ALLOCATE: Self = Self(0x4B);
    /// Release_Master/Slave_Connection_Set, on class 03.
    pub const RELEASE: Self = Self(0x4C);

    /// The code with the response bit set.
    #[must_use]
    pub const fn response(self) -> u8 {
        self.0 | 0x80
    }
}

/// A general status code, the third octet of an error response. Unknown codes survive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GeneralStatus(pub u8);

impl GeneralStatus {
    /// 02: resource unavailable.
    pub const RESOURCE_UNAVAILABLE: Self = Self(0x02);
    /// 05: path destination unknown.
    pub const PATH_UNKNOWN: Self = Self(0x05);
    /// 08: service not supported.
    pub const SERVICE_NOT_SUPPORTED: Self = Self(0x08);
    /// 09: invalid attribute value.
    pub const INVALID_ATTRIBUTE_VALUE: Self = Self(0x09);
    /// 0B: already in the requested mode or state.
    pub const ALREADY_IN_STATE: Self = Self(0x0B);
    /// 0C: object state conflict.
    pub const OBJECT_STATE_CONFLICT: Self = Self(0x0C);
    /// 0E: attribute not settable.
    pub const ATTRIBUTE_NOT_SETTABLE: Self = Self(0x0E);
    /// 10: device state conflict.
    pub const DEVICE_STATE_CONFLICT: Self = Self(0x10);
    /// 13: not enough data.
    pub const NOT_ENOUGH_DATA: Self = Self(0x13);
    /// 14: attribute not supported.
    pub const ATTRIBUTE_NOT_SUPPORTED: Self = Self(0x14);
    /// 15: too much data.
    pub const TOO_MUCH_DATA: Self = Self(0x15);
    /// 16: object does not exist.
    pub const OBJECT_DOES_NOT_EXIST: Self = Self(0x16);
    /// 18: no stored attribute data.
    pub const NO_STORED_DATA: Self = Self(0x18);
    /// 19: store operation failure.
    pub const STORE_FAILED: Self = Self(0x19);
    /// 20: invalid parameter.
    pub const INVALID_PARAMETER: Self = Self(0x20);

    /// The standard's words for the code (CIP volume 1, appendix B); D0 … FF belong to the classes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self.0 {
            0x00 => "success",
            0x01 => "connection failure",
            0x02 => "resource unavailable",
            0x03 => "invalid parameter value",
            0x04 => "path segment error",
            0x05 => "path destination unknown",
            0x06 => "partial transfer",
            0x07 => "connection lost",
            0x08 => "service not supported",
            0x09 => "invalid attribute value",
            0x0A => "attribute list error",
            0x0B => "already in the requested state",
            0x0C => "object state conflict",
            0x0D => "object already exists",
            0x0E => "attribute not settable",
            0x0F => "privilege violation",
            0x10 => "device state conflict",
            0x11 => "reply data too large",
            0x12 => "fragmentation of a primitive value",
            0x13 => "not enough data",
            0x14 => "attribute not supported",
            0x15 => "too much data",
            0x16 => "object does not exist",
            0x17 => "service fragmentation sequence not in progress",
            0x18 => "no stored attribute data",
            0x19 => "store operation failed",
            0x1A => "routing failure, request packet too large",
            0x1B => "routing failure, response packet too large",
            0x1C => "missing attribute list entry data",
            0x1D => "invalid attribute value list",
            0x1E => "embedded service error",
            0x1F => "vendor specific error",
            0x20 => "invalid parameter",
            0x21 => "write-once value or medium already written",
            0x22 => "invalid reply received",
            0x25 => "key failure in path",
            0x26 => "path size invalid",
            0x27 => "unexpected attribute in list",
            0x28 => "invalid member ID",
            0x29 => "member not settable",
            0x2A => "group 2 only server general failure",
            0xD0.. => "error of the object class",
            _ => "unknown status",
        }
    }
}

/// Why a request is refused: general status and additional code (FF = none).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error {
    /// The general status.
    pub general: GeneralStatus,
    /// The object-specific additional code; FF where there is none.
    pub additional: u8,
}

impl Error {
    /// A refusal with an additional code of the object.
    #[must_use]
    pub const fn with(general: GeneralStatus, additional: u8) -> Self {
        Self { general, additional }
    }
}

impl From<GeneralStatus> for Error {
    fn from(general: GeneralStatus) -> Self {
        Self { general, additional: 0xFF }
    }
}

impl fmt::Display for Error {
    /// `0E attribute not settable`, with the additional code where there is one.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02X} {}", self.general.0, self.general.name())?;
        if self.additional != 0xFF {
            write!(f, " (additional code {:02X})", self.additional)?;
        }
        Ok(())
    }
}

impl core::error::Error for Error {}

/// A class code.
pub mod class {
    /// Identity.
    pub const IDENTITY: u8 = 0x01;
    /// Message Router.
    pub const MESSAGE_ROUTER: u8 = 0x02;
    /// DeviceNet.
    pub const DEVICENET: u8 = 0x03;
    /// Assembly.
    pub const ASSEMBLY: u8 = 0x04;
    /// Connection.
    pub const CONNECTION: u8 = 0x05;
    /// Acknowledge Handler.
    pub const ACKNOWLEDGE_HANDLER: u8 = 0x2B;
}

/// Names one attribute: class, instance (0 = the class itself), attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Path {
    /// Class code.
    pub class: u8,
    /// Instance number; 0 is the class itself.
    pub instance: u8,
    /// Attribute number.
    pub attribute: u8,
}

impl fmt::Display for Path {
    /// `2f/1/7`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:02x}/{}/{}", self.class, self.instance, self.attribute)
    }
}

/// A frame of a head and what follows it, eight octets together at most.
pub(crate) fn frame(identifier: u16, head: &[u8], rest: &[u8]) -> Frame {
    let mut octets = [0; 8];
    for (to, from) in octets.iter_mut().zip(head.iter().chain(rest)) {
        *to = *from;
    }
    Frame::of_octets(identifier, octets, head.len() + rest.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_header_is_two_bits_and_a_mac_id() {
        let header = Header(0xCA);
        assert!(header.fragmented() && header.transaction());
        assert_eq!(header.mac(), MacId::new(10).unwrap());
        assert_eq!(header.with_fragmented(true), header);
        assert_eq!(header.with_fragmented(false), Header(0x4A));
        assert_eq!(header.of_next_transaction(), Header(0x8A));
    }

    #[test]
    fn a_refusal_reads_as_a_sentence() {
        let plain = Error::from(GeneralStatus::ATTRIBUTE_NOT_SETTABLE);
        assert_eq!(plain.to_string(), "0E attribute not settable");
        let owned = Error::with(GeneralStatus::OBJECT_STATE_CONFLICT, 1);
        assert_eq!(owned.to_string(), "0C object state conflict (additional code 01)");
        for (status, words) in
            [(0x0F, "0F privilege violation"), (0x1F, "1F vendor specific error")]
        {
            assert_eq!(Error::from(GeneralStatus(status)).to_string(), words);
        }
    }
}
