//! The explicit messages of a server: requests on their way in, one response on its way out.

use codewheel_station::can::Frame;
use codewheel_station::{Deadline, Instant};

use super::{REQUEST_OCTETS, RESPONSE_OCTETS};
use crate::explicit::{Error, Header, Service, frame};
use crate::fragment::{
    FIRST_AND_ONLY, Fragment, Kind, Piece, Reassembly, Received, STATUS_OK, STATUS_TOO_MUCH_DATA,
    Sending,
};

/// A service that is answered once the device has done it.
#[derive(Clone, Copy, Debug)]
struct Pending {
    header: Header,
    service: Service,
    result: Option<Result<(), Error>>,
}

/// A response on the unconnected port: header, at most three octets, how many.
#[derive(Clone, Copy, Debug)]
struct Unconnected {
    header: Header,
    body: [u8; 3],
    length: u8,
}

#[derive(Clone, Debug)]
pub(super) struct Messages {
    /// The fragmented request on its way in, and the header of its fragments.
    request: Reassembly<REQUEST_OCTETS>,
    request_header: Header,
    /// The response on its way out.
    response: [u8; RESPONSE_OCTETS],
    response_header: Header,
    sending: Sending,
    /// A fragment to be acknowledged: its header, count and status.
    acknowledge: Option<(Header, u8, u8)>,
    unconnected: Option<Unconnected>,
    pending: Option<Pending>,
}

impl Messages {
    pub(super) const fn new() -> Self {
        Self {
            request: Reassembly::new(),
            request_header: Header(0),
            response: [0; RESPONSE_OCTETS],
            response_header: Header(0),
            sending: Sending::IDLE,
            acknowledge: None,
            unconnected: None,
            pending: None,
        }
    }

    /// The explicit connection has ended: nothing of it is left to say.
    pub(super) fn end(&mut self) {
        self.request.clear();
        self.sending.stop();
        self.acknowledge = None;
        self.pending = None;
    }

    /// An unfragmented request arrived: it ends a reassembly.
    pub(super) const fn unfragmented(&mut self) {
        self.request.clear();
    }

    /// A fragment arrived. Returns the body of the request once it is complete, in a copy with its
    /// length, and owes the acknowledge.
    pub(super) fn fragment(
        &mut self,
        header: Header,
        octet: u8,
        octets: &[u8],
    ) -> Option<([u8; REQUEST_OCTETS], usize)> {
        let fragment = Fragment::from_octet(octet);
        if fragment.kind == Kind::Acknowledge {
            if let [status, ..] = *octets {
                self.sending.acknowledged(fragment.count, status);
            }
            return None;
        }
        if fragment.kind == Kind::First {
            if octets.is_empty() {
                // A message that begins with nothing is none.
                return None;
            }
            if self.is_repeated(header, fragment, octets) {
                self.acknowledge = Some((header, fragment.count, STATUS_OK));
                return None;
            }
            self.request_header = header;
        } else if header != self.request_header {
            // Another transaction cannot go on with this one's message.
            self.request.clear();
            return None;
        }
        let received = self.request.push(fragment, octets);
        let status = match received {
            Received::Dropped => return None,
            Received::Taken | Received::Complete => STATUS_OK,
            Received::TooMuch => STATUS_TOO_MUCH_DATA,
        };
        self.acknowledge = Some((header, fragment.count, status));
        if received != Received::Complete {
            return None;
        }
        let mut body = [0; REQUEST_OCTETS];
        let length = self.request.body().len();
        for (to, from) in body.iter_mut().zip(self.request.body()) {
            *to = *from;
        }
        Some((body, length))
    }

    /// Whether a first-and-only fragment is the one whose answer is still on its way, sent again
    /// because its acknowledge got lost. Once the answer is out, the same octets are a new request
    /// (decision: a master may well ask the same twice, and must never be left without an answer).
    fn is_repeated(&self, header: Header, fragment: Fragment, octets: &[u8]) -> bool {
        let answering = self.pending.is_some() || !self.sending.is_idle();
        answering
            && fragment.count == FIRST_AND_ONLY
            && header == self.request_header
            && octets == self.request.body()
    }

    /// Owes the acknowledge of a fragment once more, after [`end`](Self::end) has dropped it.
    pub(super) const fn acknowledge(&mut self, header: Header, octet: u8) {
        self.acknowledge = Some((header, Fragment::from_octet(octet).count, STATUS_OK));
    }

    /// Whether a service is being carried out.
    pub(super) const fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// Whether a response, or a piece of it, has not been handed out yet.
    pub(super) const fn is_owed(&self) -> bool {
        self.sending.is_owed() || self.pending.is_some()
    }

    /// The service that `header` asked for will be answered later.
    pub(super) const fn defer(&mut self, header: Header, service: Service) {
        self.pending = Some(Pending { header, service, result: None });
    }

    /// The deferred service has ended.
    pub(super) const fn complete(&mut self, result: Result<(), Error>) {
        if let Some(pending) = &mut self.pending {
            pending.result = Some(result);
        }
    }

    /// The room for the data of a response, behind its service octet.
    pub(super) fn room(&mut self) -> &mut [u8] {
        let [_, room @ ..] = &mut self.response;
        room
    }

    /// Begins to send a response; `written` octets of data already stand in its
    /// [`room`](Self::room).
    pub(super) fn respond(
        &mut self,
        header: Header,
        service: Service,
        result: Result<usize, Error>,
    ) {
        let [first, second, third, ..] = &mut self.response;
        let length = match result {
            Ok(written) => {
                *first = service.response();
                written + 1
            }
            Err(error) => {
                *first = Service::ERROR.response();
                *second = error.general.0;
                *third = error.additional;
                3
            }
        };
        self.response_header = header.with_fragmented(false);
        self.sending.begin(length as u16);
    }

    /// Owes a response on the unconnected port. One that waits already is replaced, unless that
    /// would keep a master from hearing that its allocation was granted.
    pub(super) fn respond_unconnected(
        &mut self,
        header: Header,
        service: Service,
        result: Result<(u8, usize), Error>,
    ) {
        let good_news = Service::ERROR.response();
        let keeps = self.unconnected.is_some_and(|waiting| {
            let [first, ..] = waiting.body;
            first != good_news
        });
        let (body, length) = match result {
            Ok((octet, written)) => ([service.response(), octet, 0], written as u8 + 1),
            Err(_) if keeps => return,
            Err(error) => ([Service::ERROR.response(), error.general.0, error.additional], 3),
        };
        self.unconnected =
            Some(Unconnected { header: header.with_fragmented(false), body, length });
    }

    /// A frame of ours with the identifier of explicit responses went out.
    pub(super) fn sent(&mut self, now: Instant, frame: &Frame) {
        // Only the fragment that waits for its acknowledge: other masters' refusals go out under
        // the same identifier and must not prolong that wait.
        if let [header, octet, ..] = *frame.data()
            && header == self.response_header.with_fragmented(true).0
            && Fragment::from_octet(octet).kind != Kind::Acknowledge
        {
            self.sending.sent(now);
        }
    }

    /// Whether a response was just given up.
    pub(super) fn advance(&mut self, now: Instant) -> bool {
        self.sending.advance(now)
    }

    pub(super) const fn deadline(&self) -> Deadline {
        self.sending.deadline()
    }

    /// The next frame with `identifier`: what strangers wait for, then acknowledges, then the
    /// response.
    pub(super) fn transmit(&mut self, now: Instant, identifier: u16) -> Option<Frame> {
        let mut octets = [0; 8];
        let [first, second, rest @ ..] = &mut octets;
        if let Some(Unconnected { header, body, length }) = self.unconnected.take() {
            let body = body.get(..usize::from(length)).unwrap_or(&body);
            return Some(frame(identifier, &[header.0], body));
        }
        if let Some((header, count, status)) = self.acknowledge.take() {
            *first = header.with_fragmented(true).0;
            *second = Fragment { kind: Kind::Acknowledge, count }.to_octet();
            let [third, ..] = rest;
            *third = status;
            return Some(Frame::standard(identifier, octets.get(..3).unwrap_or_default()));
        }
        if self.sending.is_idle()
            && let Some(Pending { header, service, result: Some(result) }) = self.pending
        {
            self.pending = None;
            self.respond(header, service, result.map(|()| 0));
        }
        if !self.sending.is_owed() {
            return None;
        }
        let header = self.response_header;
        Some(match self.sending.next(now, &self.response)? {
            Piece::Whole(octets) => frame(identifier, &[header.0], octets),
            Piece::Fragment(fragment, octets) => {
                let head = [header.with_fragmented(true).0, fragment.to_octet()];
                frame(identifier, &head, octets)
            }
        })
    }
}
