//! Reading a device never seen before by its Parameter object (class 0Fh; CIP volume 1,
//! chapter 5-14): what it can be told, in its own words.

use core::fmt;

use super::view::Response;
use crate::explicit::{GeneralStatus, Service};

/// The class code of the Parameter object.
pub const PARAMETER: u8 = 0x0F;

/// The highest instance that body format 8/8 can name.
const MAX_INSTANCE: u16 = 255;
/// Class descriptor bit 1: instances have all attributes, rather than 1 … 6 alone.
const FULL_ATTRIBUTES: u16 = 1 << 1;
/// The last attribute of a stub, and of a full instance.
const LAST_OF_STUB: u8 = 6;
const LAST_OF_FULL: u8 = 21;
/// How often a request without an answer is repeated.
const REPEATS: u8 = 1;

/// Up to `N` octets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Octets<const N: usize> {
    octets: [u8; N],
    length: u8,
}

impl<const N: usize> Octets<N> {
    const NONE: Self = {
        assert!(N <= u8::MAX as usize, "lengths are kept in 8 bits");
        Self { octets: [0; N], length: 0 }
    };

    /// The first `N` of `octets`.
    fn of(octets: &[u8]) -> Self {
        let mut kept = Self::NONE;
        for (to, from) in kept.octets.iter_mut().zip(octets) {
            *to = *from;
        }
        kept.length = octets.len().min(N) as u8;
        kept
    }

    /// The octets.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        self.octets.get(..usize::from(self.length)).unwrap_or_default()
    }
}

/// A text of up to `N` characters, ISO 8859-1 on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text<const N: usize>(Octets<N>);

impl<const N: usize> Text<N> {
    /// Reads a SHORT_STRING: a length octet and as many characters as there are.
    fn of(data: &[u8]) -> Self {
        let [length, characters @ ..] = data else { return Self(Octets::NONE) };
        Self(Octets::of(characters.get(..usize::from(*length)).unwrap_or(characters)))
    }

    /// The characters as they came.
    #[must_use]
    pub fn as_octets(&self) -> &[u8] {
        self.0.as_slice()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.length == 0
    }
}

impl<const N: usize> fmt::Display for Text<N> {
    /// The characters; those that cannot be printed as `?`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use fmt::Write as _;
        self.as_octets().iter().try_for_each(|octet| {
            let character = char::from(*octet);
            f.write_char(if character.is_control() { '?' } else { character })
        })
    }
}

/// A limit of a parameter, as its octets.
pub type Value = Octets<8>;

/// The elementary data type of a parameter (CIP volume 1, appendix C; the codes below 20h are those
/// of the DeviceNet specification 1.x and 2.0).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct DataType(pub u8);

impl DataType {
    /// The name of the type; `None` for a code that has none.
    #[must_use]
    pub const fn name(self) -> Option<&'static str> {
        Some(match self.0 {
            0x01 | 0xD2 => "WORD",
            0x02 | 0xC7 => "UINT",
            0x03 | 0xC3 => "INT",
            0x04 | 0xC1 => "BOOL",
            0x05 | 0xC2 => "SINT",
            0x06 | 0xC4 => "DINT",
            0x07 | 0xC5 => "LINT",
            0x08 | 0xC6 => "USINT",
            0x09 | 0xC8 => "UDINT",
            0x0A | 0xC9 => "ULINT",
            0x0B | 0xCA => "REAL",
            0x0C | 0xCB => "LREAL",
            0xD0 => "STRING",
            0xD1 => "BYTE",
            0xD3 => "DWORD",
            0xD4 => "LWORD",
            0xDA => "SHORT_STRING",
            _ => return None,
        })
    }

    /// Whether its numbers have a sign.
    #[must_use]
    pub const fn is_signed(self) -> bool {
        matches!(self.0, 0x03 | 0x05..=0x07 | 0xC2..=0xC5)
    }

    /// Whether it is an integer, or a string of bits that is written as one.
    #[must_use]
    pub const fn is_integer(self) -> bool {
        matches!(self.0, 0x01..=0x0A | 0xC1..=0xC9 | 0xD1..=0xD4)
    }

    /// `octets` as a number; `None` where the type is no integer, or they are none or more than
    /// eight.
    #[must_use]
    pub fn number(self, octets: &[u8]) -> Option<i128> {
        if !self.is_integer() || octets.is_empty() || octets.len() > 8 {
            return None;
        }
        let negative = self.is_signed() && octets.last().is_some_and(|octet| octet & 0x80 != 0);
        let mut all = [if negative { 0xFF } else { 0 }; 16];
        for (to, from) in all.iter_mut().zip(octets) {
            *to = *from;
        }
        Some(i128::from_le_bytes(all))
    }
}

/// One instance of the Parameter object. What the device does not tell is empty or zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// The instance number, from 1 on.
    pub number: u8,
    /// Attribute 1, the value now, as long as a response can be: a text, perhaps.
    pub value: Octets<255>,
    /// Attribute 3, the path of the attribute that this parameter is, such as `20 2F 24 01 30 07`.
    pub link: Octets<16>,
    /// Attribute 4: bit 1 enumerated, 2 scaled, 3 scaled by other parameters, 4 read only, 5 monitor.
    pub descriptor: u16,
    /// Attribute 5.
    pub data_type: DataType,
    /// Attribute 6, the octets of the value.
    pub size: u8,
    /// Attribute 7.
    pub name: Text<16>,
    /// Attribute 8.
    pub units: Text<4>,
    /// Attribute 9.
    pub help: Text<64>,
    /// Attribute 10.
    pub minimum: Value,
    /// Attribute 11.
    pub maximum: Value,
    /// Attribute 12.
    pub default: Value,
    /// Attributes 13 … 16, scaling: multiplier, divisor, base, and the offset, a signed number.
    pub scaling: [u16; 4],
    /// Attributes 17 … 20: the parameters that replace those of the scaling, 0 = none.
    pub scaling_links: [u16; 4],
    /// Attribute 21, decimals to be shown.
    pub decimals: u8,
}

impl Parameter {
    const NONE: Self = Self {
        number: 0,
        value: Octets::NONE,
        link: Octets::NONE,
        descriptor: 0,
        data_type: DataType(0),
        size: 0,
        name: Text(Octets::NONE),
        units: Text(Octets::NONE),
        help: Text(Octets::NONE),
        minimum: Octets::NONE,
        maximum: Octets::NONE,
        default: Octets::NONE,
        scaling: [1, 1, 1, 0],
        scaling_links: [0; 4],
        decimals: 0,
    };

    /// Whether the parameter cannot be set (descriptor bit 4).
    #[must_use]
    pub const fn is_read_only(&self) -> bool {
        self.descriptor & 1 << 4 != 0
    }

    /// Whether its numbers are scaled for people (descriptor bit 2).
    #[must_use]
    pub const fn is_scaled(&self) -> bool {
        self.descriptor & 1 << 2 != 0
    }

    /// Whether its values have names (descriptor bit 1).
    #[must_use]
    pub const fn is_enumerated(&self) -> bool {
        self.descriptor & 1 << 1 != 0
    }

    fn take(&mut self, attribute: u8, data: &[u8]) {
        let word = match *data {
            [low, high, ..] => u16::from_le_bytes([low, high]),
            [low] => u16::from(low),
            [] => 0,
        };
        match attribute {
            1 => self.value = Octets::of(data),
            3 => self.link = Octets::of(data),
            4 => self.descriptor = word,
            5 => self.data_type = DataType(word.to_le_bytes()[0]),
            6 => self.size = word.to_le_bytes()[0],
            7 => self.name = Text::of(data),
            8 => self.units = Text::of(data),
            9 => self.help = Text::of(data),
            10 => self.minimum = Octets::of(data),
            11 => self.maximum = Octets::of(data),
            12 => self.default = Octets::of(data),
            13..=16 => put(&mut self.scaling, attribute - 13, word),
            17..=20 => put(&mut self.scaling_links, attribute - 17, word),
            21 => self.decimals = word.to_le_bytes()[0],
            _ => {}
        }
    }
}

fn put(words: &mut [u16], place: u8, word: u16) {
    if let Some(to) = words.get_mut(usize::from(place)) {
        *to = word;
    }
}

/// What a response brought the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walked<'a> {
    /// Nothing to show yet: send the next [`request`](ParameterWalk::request).
    On,
    /// A parameter is complete. Send the next request, if there is one.
    Parameter(&'a Parameter),
    /// There is no further parameter.
    End,
    /// The device does not answer any more.
    NoAnswer,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// Class attribute 2: how many instances there are.
    MaxInstance,
    /// Class attribute 8.
    ClassDescriptor,
    /// An attribute of an instance.
    Instance {
        number: u8,
        attribute: u8,
    },
    End,
}

/// Walks all instances of a Parameter object, one attribute at a time: it says what to ask and
/// takes what came back. How the request gets there — a [`Ticket`](super::Ticket) of the scanner,
/// or anything else — is not its matter.
///
/// ```
/// use codewheel_devicenet::scanner::{ParameterWalk, Response, Walked};
///
/// # fn ask(request: &[u8]) -> Response<'static> {
/// #     match request { [0x0E, 0x0F, 0, 2] => Response::Done(&[1, 0]), _ => Response::Done(&[7]) }
/// # }
/// let mut walk = ParameterWalk::new();
/// let mut found = 0;
/// while let Some(request) = walk.request() {
///     if let Walked::Parameter(parameter) = walk.take(ask(&request)) {
///         found += 1;
///         assert_eq!(parameter.value.as_slice(), [7]);
///     }
/// }
/// assert_eq!(found, 1);
/// ```
#[derive(Clone, Debug)]
pub struct ParameterWalk {
    place: Place,
    first_instance: u8,
    last_instance: u8,
    last_attribute: u8,
    repeats: u8,
    parameter: Parameter,
}

impl Default for ParameterWalk {
    fn default() -> Self {
        Self::new()
    }
}

impl ParameterWalk {
    /// A walk that begins with the class attributes.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            place: Place::MaxInstance,
            first_instance: 1,
            last_instance: 0,
            last_attribute: LAST_OF_FULL,
            repeats: 0,
            parameter: Parameter::NONE,
        }
    }

    /// A walk over instance `number` alone, 1 … 255. Where the device has no such instance it brings
    /// no parameter.
    #[must_use]
    pub const fn of_one(number: u8) -> Self {
        Self {
            place: Place::ClassDescriptor,
            first_instance: number,
            last_instance: number,
            ..Self::new()
        }
    }

    /// The body of the next request, or `None` when the walk is over.
    #[must_use]
    pub const fn request(&self) -> Option<[u8; 4]> {
        let (instance, attribute) = match self.place {
            Place::MaxInstance => (0, 2),
            Place::ClassDescriptor => (0, 8),
            Place::Instance { number, attribute } => (number, attribute),
            Place::End => return None,
        };
        Some([Service::GET_ATTRIBUTE_SINGLE.0, PARAMETER, instance, attribute])
    }

    /// How many instances there are; 0 until it is known.
    #[must_use]
    pub const fn count(&self) -> u8 {
        self.last_instance
    }

    /// Takes in what came back for the last [`request`](Self::request). An attribute that is
    /// refused stays empty; an instance that does not exist is passed over; a request without an
    /// answer is repeated once.
    pub fn take(&mut self, response: Response<'_>) -> Walked<'_> {
        let (data, missing) = match response {
            Response::Done(data) => (data, false),
            Response::Refused(error) => {
                (&[][..], error.general == GeneralStatus::OBJECT_DOES_NOT_EXIST)
            }
            Response::TooLong => (&[][..], false),
            Response::NoAnswer if self.repeats < REPEATS => {
                self.repeats += 1;
                return Walked::On;
            }
            Response::NoAnswer => {
                self.place = Place::End;
                return Walked::NoAnswer;
            }
        };
        self.repeats = 0;
        match self.place {
            Place::MaxInstance => {
                let count = match *data {
                    [low, high, ..] => u16::from_le_bytes([low, high]),
                    _ => 0,
                };
                self.last_instance = count.min(MAX_INSTANCE) as u8;
                if count == 0 {
                    self.place = Place::End;
                    return Walked::End;
                }
                self.place = Place::ClassDescriptor;
                Walked::On
            }
            Place::ClassDescriptor => {
                if let [low, high, ..] = *data
                    && u16::from_le_bytes([low, high]) & FULL_ATTRIBUTES == 0
                {
                    self.last_attribute = LAST_OF_STUB;
                }
                self.place = Place::Instance { number: self.first_instance, attribute: 1 };
                Walked::On
            }
            Place::Instance { number, attribute } => {
                if missing {
                    self.leave(number);
                    return if self.place == Place::End { Walked::End } else { Walked::On };
                }
                if attribute == 1 {
                    // The one before was lent until now.
                    self.parameter = Parameter { number, ..Parameter::NONE };
                }
                self.parameter.take(attribute, data);
                if attribute >= self.last_attribute {
                    self.leave(number);
                    return Walked::Parameter(&self.parameter);
                }
                // The size of the path is the length of the path.
                let attribute = if attribute == 1 { 3 } else { attribute + 1 };
                self.place = Place::Instance { number, attribute };
                Walked::On
            }
            Place::End => Walked::End,
        }
    }

    const fn leave(&mut self, number: u8) {
        self.place = if number >= self.last_instance {
            Place::End
        } else {
            Place::Instance { number: number + 1, attribute: 1 }
        };
    }
}
