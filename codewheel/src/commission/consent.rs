//! Asking before something is written.

use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{self, RecvTimeoutError, TryRecvError};
use std::thread;
use std::time::Duration;

use codewheel_device::product::Bus;

use super::encoder::Encoder;
use crate::arguments::commission::Consent;
use crate::failure::Failure;

/// How often an explicit connection is used meanwhile, so that it does not time out.
const IDLE: Duration = Duration::from_millis(200);

impl Consent {
    /// Refuses at once what nobody can consent to later, before a bus is touched.
    pub(super) fn can_be_had(self) -> Result<(), Failure> {
        if self.yes || (io::stdin().is_terminal() && io::stderr().is_terminal()) {
            return Ok(());
        }
        Err(Failure::Usage(
            "this writes, and there is no terminal to ask on; nothing was done: add --yes to do it \
             without asking"
                .to_owned(),
        ))
    }

    /// Asks, unless it was given. The encoder is served meanwhile.
    pub(super) fn ask(self, question: &str, encoder: &mut Encoder) -> Result<(), Failure> {
        if self.yes {
            return Ok(());
        }
        ask(question)?;
        let (sender, answer) = mpsc::channel();
        thread::spawn(move || {
            let mut line = String::new();
            let read = io::stdin().read_line(&mut line);
            // Where nobody waits any more, nobody need know.
            let _ = sender.send(read.map(|_| line));
        });
        loop {
            let wait = match encoder.session.bus() {
                // A connection of DeviceNet lives as long as it is used.
                Bus::DeviceNet => {
                    encoder.session.value(&encoder.pulse)?;
                    answer.recv_timeout(IDLE)
                }
                // A master of PROFIBUS has a token to pass on and a slave to poll at any time.
                Bus::Profibus => {
                    encoder.session.sample()?;
                    answer.try_recv().map_err(|error| match error {
                        TryRecvError::Empty => RecvTimeoutError::Timeout,
                        TryRecvError::Disconnected => RecvTimeoutError::Disconnected,
                    })
                }
            };
            match wait {
                Err(RecvTimeoutError::Timeout) => {}
                Ok(line) => return judge(&line?),
                Err(RecvTimeoutError::Disconnected) => return judge(""),
            }
        }
    }

    /// Asks where no encoder waits.
    pub(super) fn ask_alone(self, question: &str) -> Result<(), Failure> {
        if self.yes {
            return Ok(());
        }
        ask(question)?;
        let mut line = String::new();
        io::stdin().read_line(&mut line)?;
        judge(&line)
    }
}

fn ask(question: &str) -> Result<(), Failure> {
    let mut err = io::stderr().lock();
    write!(err, "{question} [y/N] ")?;
    err.flush()?;
    Ok(())
}

fn judge(line: &str) -> Result<(), Failure> {
    match line.trim().to_ascii_lowercase().as_str() {
        "y" | "yes" => Ok(()),
        _ => Err(Failure::Usage("nothing was written".to_owned())),
    }
}
