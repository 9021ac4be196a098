//! What records say, for programs: who asked, who answered, and the octets of both.

/// What a record says, where it is more than a step on the way: a question with its good answer, or
/// what a device produces by itself. See [`Decoder::hear`](crate::Decoder::hear).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Said<'a> {
    /// On DeviceNet.
    DeviceNet(DeviceNetSaid<'a>),
    /// On PROFIBUS.
    Profibus(ProfibusSaid<'a>),
}

/// What is said on DeviceNet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceNetSaid<'a> {
    /// A node looks whether its MAC ID is free, or says that it is not.
    DuplicateCheck {
        /// Its MAC ID.
        mac: u8,
        /// Its vendor.
        vendor: u16,
        /// Its serial number.
        serial: u32,
    },
    /// An explicit request was done. Fragments have been put together.
    Done {
        /// Who did it.
        slave: u8,
        /// Who asked, as the header of the message says.
        master: u8,
        /// The service code of the request.
        service: u8,
        /// The class.
        class: u8,
        /// The instance.
        instance: u8,
        /// Of Get_Attribute_Single and Set_Attribute_Single.
        attribute: Option<u8>,
        /// What the request carried behind these.
        request: &'a [u8],
        /// What the response carried behind its service.
        response: &'a [u8],
    },
    /// An I/O connection produced.
    Produced {
        /// Who.
        slave: u8,
        /// What.
        data: &'a [u8],
    },
}

/// What is said on PROFIBUS: a request with its good answer. Whether a slave liked what Set_Prm and
/// Chk_Cfg brought it, only its next diagnosis tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProfibusSaid<'a> {
    /// Who answered.
    pub slave: u8,
    /// Who asked.
    pub master: u8,
    /// The service access point of the slave; `None` of Data_Exchange.
    pub sap: Option<u8>,
    /// The data of the request.
    pub request: &'a [u8],
    /// The data of the answer, none of a short acknowledge.
    pub response: &'a [u8],
}

/// Whoever hears what is said.
pub(crate) struct Listener<'o>(pub(crate) Option<&'o mut dyn FnMut(Said<'_>)>);

impl Listener<'_> {
    pub(crate) fn tell(&mut self, said: Said<'_>) {
        if let Some(listener) = &mut self.0 {
            listener(said);
        }
    }
}

impl std::fmt::Debug for Listener<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Listener").field(&self.0.is_some()).finish()
    }
}
