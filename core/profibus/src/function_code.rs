//! The function code FC: what a request wants, what an answer says (EN 50170-2, FDL).

/// The function code octet of SD1, SD2 and SD3.
///
/// | bit | request | answer |
/// |---|---|---|
/// | 7 | 0 | 0 |
/// | 6 | 1 | 0 |
/// | 5 | FCB, frame count bit | station type, high bit |
/// | 4 | FCV, the FCB is valid | station type, low bit |
/// | 3–0 | [`Function`] | [`Reply`] |
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FunctionCode(pub u8);

/// What a request wants: the low four bits of its function code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    /// Send data with acknowledge, low priority.
    SdaLow = 0x3,
    /// Send data with no acknowledge, low priority.
    SdnLow = 0x4,
    /// Send data with acknowledge, high priority.
    SdaHigh = 0x5,
    /// Send data with no acknowledge, high priority.
    SdnHigh = 0x6,
    /// Request FDL status.
    FdlStatus = 0x9,
    /// Send and request data, low priority.
    SrdLow = 0xC,
    /// Send and request data, high priority.
    SrdHigh = 0xD,
    /// Request ident.
    Ident = 0xE,
    /// Request LSAP status.
    LsapStatus = 0xF,
}

/// What an answer says: the low four bits of its function code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reply {
    /// OK: acknowledged.
    Ok = 0x0,
    /// UE: user error.
    UserError = 0x1,
    /// RR: no resource.
    NoResource = 0x2,
    /// RS: service not activated.
    NotActivated = 0x3,
    /// DL: data, low priority.
    DataLow = 0x8,
    /// NR: no data ready.
    NotReady = 0x9,
    /// DH: data, high priority. A DP slave says so that its diagnosis is to be read.
    DataHigh = 0xA,
    /// RDL: data, low priority, but no resource for what was sent.
    NoResourceDataLow = 0xC,
    /// RDH: data, high priority, but no resource for what was sent.
    NoResourceDataHigh = 0xD,
}

impl FunctionCode {
    const REQUEST: u8 = 0x40;
    const FRAME_COUNT: u8 = 0x20;
    const FRAME_COUNT_VALID: u8 = 0x10;

    /// The code of a request, with its FCB and FCV.
    #[must_use]
    pub const fn request(function: Function, frame_count: bool, valid: bool) -> Self {
        Self(
            Self::REQUEST
                | if frame_count { Self::FRAME_COUNT } else { 0 }
                | if valid { Self::FRAME_COUNT_VALID } else { 0 }
                | function as u8,
        )
    }

    /// The code of a slave's answer.
    #[must_use]
    pub const fn reply(reply: Reply) -> Self {
        Self(reply as u8)
    }

    /// Whether it is a request's: bit 6, whatever bit 7 says.
    #[inline]
    #[must_use]
    pub const fn is_request(self) -> bool {
        self.0 & Self::REQUEST != 0
    }

    /// FCB, which a master toggles with each new request.
    #[inline]
    #[must_use]
    pub const fn frame_count(self) -> bool {
        self.0 & Self::FRAME_COUNT != 0
    }

    /// FCV: whether the FCB says anything.
    #[inline]
    #[must_use]
    pub const fn frame_count_valid(self) -> bool {
        self.0 & Self::FRAME_COUNT_VALID != 0
    }

    /// What the request wants; `None` for an answer, a reserved code, or with bit 7 set.
    #[inline]
    #[must_use]
    pub const fn function(self) -> Option<Function> {
        if self.0 & 0xC0 != Self::REQUEST {
            return None;
        }
        Some(match self.0 & 0x0F {
            0x3 => Function::SdaLow,
            0x4 => Function::SdnLow,
            0x5 => Function::SdaHigh,
            0x6 => Function::SdnHigh,
            0x9 => Function::FdlStatus,
            0xC => Function::SrdLow,
            0xD => Function::SrdHigh,
            0xE => Function::Ident,
            0xF => Function::LsapStatus,
            _ => return None,
        })
    }

    /// What the answer says; `None` for a request, a reserved code, or with bit 7 set.
    #[must_use]
    pub const fn answer(self) -> Option<Reply> {
        if self.0 & 0xC0 != 0 {
            return None;
        }
        Some(match self.0 & 0x0F {
            0x0 => Reply::Ok,
            0x1 => Reply::UserError,
            0x2 => Reply::NoResource,
            0x3 => Reply::NotActivated,
            0x8 => Reply::DataLow,
            0x9 => Reply::NotReady,
            0xA => Reply::DataHigh,
            0xC => Reply::NoResourceDataLow,
            0xD => Reply::NoResourceDataHigh,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_codes_of_a_bring_up_are_those_of_the_book() {
        let code = FunctionCode::request;
        assert_eq!(code(Function::SrdLow, true, false), FunctionCode(0x6C));
        assert_eq!(code(Function::SrdHigh, true, true), FunctionCode(0x7D));
        assert_eq!(code(Function::SrdHigh, false, true), FunctionCode(0x5D));
        assert_eq!(code(Function::FdlStatus, false, false), FunctionCode(0x49));
        assert_eq!(code(Function::SdnHigh, false, false), FunctionCode(0x46));
        assert_eq!(FunctionCode::reply(Reply::DataHigh), FunctionCode(0x0A));
    }

    #[test]
    fn every_code_is_a_request_or_an_answer_or_reserved_and_none_is_both() {
        let all = (0..=255).map(FunctionCode);
        let requests: Vec<_> = all.clone().filter(|code| code.function().is_some()).collect();
        let answers: Vec<_> = all.filter(|code| code.answer().is_some()).collect();
        assert_eq!(requests.len(), 9 * 4, "nine functions, FCB and FCV");
        assert_eq!(answers.len(), 9 * 4, "nine replies, four station types");
        assert!(requests.iter().all(|code| code.is_request() && code.0 & 0x80 == 0));
        assert!(answers.iter().all(|code| !code.is_request() && code.0 & 0x80 == 0));
        for code in requests {
            let function = code.function().expect("a request");
            let again =
                FunctionCode::request(function, code.frame_count(), code.frame_count_valid());
            assert_eq!(again, code);
        }
    }
}
