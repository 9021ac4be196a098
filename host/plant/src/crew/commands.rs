//! What people do to the devices of a bus while it runs.

use std::collections::VecDeque;
use std::mem::discriminant;

use codewheel_station::{Duration, Instant, Station};

use super::{Crew, Medium, Member};
use crate::check::lever_of_words;
use crate::fault::{Action, Lever};
use crate::fault_kinds::{self, End};
use crate::field_bus::{Begun, Change, FieldBus, Switches, Talker};
use crate::report::What;
use crate::{Cause, Command, Done, ObjectGroup, Refusal, Switch, SwitchPositions, Ticket};

/// How long a Save or a master may take.
const PATIENCE: Duration = Duration::from_secs(6);
/// Answers that nobody fetches; beyond them the oldest give way.
const ANSWERS: usize = 256;

/// The commands of a bus.
#[derive(Debug, Default)]
pub(super) struct Desk {
    next: u64,
    open: Vec<Open>,
    answers: VecDeque<(Ticket, Result<Done, Refusal>)>,
}

/// A command that is under way.
#[derive(Debug)]
struct Open {
    ticket: Ticket,
    place: usize,
    /// The master that carries it out, and the address it has the device at.
    master: Option<(usize, u8)>,
    begun: Begun,
    by: Instant,
}

impl<B: FieldBus> Crew<B> {
    /// Does something to the device that the plan calls `name`.
    pub(crate) fn command(
        &mut self,
        now: Instant,
        name: &str,
        command: &Command,
        medium: &mut impl Medium<B>,
    ) -> Ticket {
        let ticket = Ticket(self.desk.next);
        self.desk.next += 1;
        let done = self
            .place_of(name)
            .and_then(|place| self.obey(now, place, command, medium).map(|begun| (place, begun)));
        match done {
            Ok((_, (Begun::Done(text), _))) => self.answer(ticket, Ok(Done(text))),
            Ok((place, (begun, master))) => {
                let by = now + PATIENCE;
                self.desk.open.push(Open { ticket, place, master, begun, by });
            }
            Err(refusal) => self.answer(ticket, Err(refusal)),
        }
        ticket
    }

    /// What became of a command; `None` as long as it is under way.
    pub(crate) fn take_answer(
        &mut self,
        now: Instant,
        ticket: Ticket,
        medium: &mut impl Medium<B>,
    ) -> Option<Result<Done, Refusal>> {
        if let Some(place) = self.desk.answers.iter().position(|(of, _)| *of == ticket) {
            return self.desk.answers.remove(place).map(|(_, answer)| answer);
        }
        let place = self.desk.open.iter().position(|open| open.ticket == ticket)?;
        let answer = self.ended(now, self.desk.open.get(place)?, medium)?;
        let open = self.desk.open.swap_remove(place);
        if let Some((master, address)) = open.master
            && answer.as_ref().is_err_and(|refusal| refusal.cause == Cause::Late)
            && let Some(master) = self.master_mut(master, medium)
        {
            master.give_up(address, &open.begun);
        }
        Some(answer)
    }

    /// What can be read of the device that the plan calls `name`, and set.
    pub(crate) fn objects(
        &self,
        name: &str,
        medium: &impl Medium<B>,
    ) -> Result<Vec<ObjectGroup>, Refusal> {
        let place = self.place_of(name)?;
        let Some(device) = self.device(place, medium) else { return Err(lost(name)) };
        let master = self.master_of(place, medium).and_then(|(master, address)| {
            Some((medium.station(self.devices.len() + master)?.master()?, address))
        });
        Ok(B::objects(device.outfit(), device.powered(), master))
    }

    fn answer(&mut self, ticket: Ticket, answer: Result<Done, Refusal>) {
        if self.desk.answers.len() == ANSWERS {
            self.desk.answers.pop_front();
        }
        self.desk.answers.push_back((ticket, answer));
    }

    /// What became of a command that was under way.
    fn ended(
        &self,
        now: Instant,
        open: &Open,
        medium: &impl Medium<B>,
    ) -> Option<Result<Done, Refusal>> {
        let result = match (&open.begun, open.master) {
            (Begun::Done(_), _) => Some(Ok(())),
            (Begun::Saving(block), _) => self.device(open.place, medium)?.saved(now, block),
            (begun, Some((master, address))) => {
                let station = medium.station(self.devices.len() + master)?;
                station.master()?.ended(address, begun)
            }
            (_, None) => None,
        };
        match result {
            Some(result) => Some(result.map(|()| {
                Done(match &open.begun {
                    Begun::Done(text) => text.clone(),
                    Begun::Saving(_) => "the settings in force are kept through power cuts".into(),
                    Begun::Parameterizing(text) => {
                        format!("{text}; the device exchanges data with them")
                    }
                    Begun::Presetting(_, value) => {
                        format!("the master has given the preset {value}")
                    }
                })
            })),
            None if now >= open.by => Some(Err(Refusal::new(
                Cause::Late,
                match &open.begun {
                    Begun::Saving(_) => "the memory has not taken the record in time: look at it",
                    Begun::Presetting(..) => {
                        "the master has not given the preset in time and does not give it any more: look \
                     whether it exchanges data with the device"
                    }
                    _ => {
                        "the master has the parameters, and the device has not begun to exchange data \
                     with them in time: look whether it answers"
                    }
                },
            ))),
            None => None,
        }
    }

    /// Does it, or begins to; with the master that carries it out.
    fn obey(
        &mut self,
        now: Instant,
        place: usize,
        command: &Command,
        medium: &mut impl Medium<B>,
    ) -> Result<(Begun, Option<(usize, u8)>), Refusal> {
        let done = match command {
            Command::TurnBy(steps) => {
                self.turn(now, place, medium, |_, left| steps.saturating_add(left))
            }
            Command::TurnTo(code) => self.turn_to(now, place, *code, medium),
            Command::Motion(text) => self.set_motion(now, place, text, medium),
            Command::Stop => self.hold(now, place, medium),
            Command::Power(on) => Ok(self.switch_power(now, place, *on, medium)),
            Command::Switch(switch) => self.turn_switches(now, place, switch, medium),
            Command::Begin(words) => self.begin(now, place, words, medium),
            Command::End(kind) => self.end(now, place, kind, medium),
            Command::Write { key, value } => {
                return self.change(now, place, Change::Write(key, value), medium);
            }
            Command::Preset(value) => {
                return self.change(now, place, Change::Preset(*value), medium);
            }
            Command::Save => return self.change(now, place, Change::Save, medium),
            Command::Restore => return self.change(now, place, Change::Restore, medium),
            Command::Reset => return self.change(now, place, Change::Reset, medium),
        };
        done.map(|text| (Begun::Done(text), None))
    }

    fn place_of(&self, name: &str) -> Result<usize, Refusal> {
        self.devices.iter().position(|hand| hand.name == name).ok_or_else(|| {
            let names: Vec<_> = self.devices.iter().map(|hand| hand.name.as_str()).collect();
            let text = match names.as_slice() {
                [] => format!("there is no device {name:?}: the bus {} has none", self.name),
                names => format!(
                    "there is no device {name:?} on the bus {}: there is {}",
                    self.name,
                    names.join(", ")
                ),
            };
            Refusal::new(Cause::Unknown, text)
        })
    }

    /// Changes settings: the device itself, or the master where they are the master's.
    fn change(
        &mut self,
        now: Instant,
        place: usize,
        change: Change<'_>,
        medium: &mut impl Medium<B>,
    ) -> Result<(Begun, Option<(usize, u8)>), Refusal> {
        let model = self.device(place, medium).map(|device| device.outfit().model());
        if let Some((master, address)) = self.master_of(place, medium)
            && let Some(model) = model
            && let Some(master_now) = self.master_mut(master, medium)
            && let Some(begun) = master_now.change(now, address, model, change)
        {
            return Ok((begun?, Some((master, address))));
        }
        let Some(device) = self.device_mut(place, medium) else {
            return Err(lost(&self.devices[place].name));
        };
        Ok((device.change(now, change)?, None))
    }

    fn switch_power(
        &mut self,
        now: Instant,
        place: usize,
        on: bool,
        medium: &mut impl Medium<B>,
    ) -> String {
        let hand = &mut self.devices[place];
        let was_on = hand.unplugged.is_none();
        hand.switched_off = !on;
        let (done, what) = if on {
            if std::mem::take(&mut hand.cut) {
                // It is over now, and not once more when it would have been.
                self.agenda.forget_end(place, &Lever::PowerCut(Duration::ZERO));
            }
            self.give_power(now, place, medium);
            ("the device has power", "the power is switched on")
        } else {
            self.cut_power(now, place, medium);
            ("the device has no power", "the power is switched off")
        };
        if was_on != on {
            self.tell(now, place, what.to_owned(), medium);
        }
        done.to_owned()
    }

    fn turn_switches(
        &mut self,
        now: Instant,
        place: usize,
        switch: &Switch,
        medium: &mut impl Medium<B>,
    ) -> Result<String, Refusal> {
        let refused = |why: String| {
            let text = format!("cannot turn the switches: {why}; nothing was turned");
            Err(Refusal::new(Cause::Value, text))
        };
        if let Some(rotary) = switch.rotary.filter(|rotary| rotary.iter().any(|digit| *digit > 9)) {
            let [first, second] = rotary;
            return refused(format!("a rotary switch has 0 to 9, not {first} and {second}"));
        }
        if let Some(dip) = switch.dip.as_ref().filter(|dip| dip.len() != B::DIP.len()) {
            let has = match B::DIP.len() {
                0 => "this bus cover has no DIP switches but that of the termination".to_owned(),
                count => format!("this bus cover has {count} DIP switches"),
            };
            return refused(format!("{has}, not {}", dip.len()));
        }
        let name = self.devices[place].name.clone();
        let Some(device) = self.device_mut(place, medium) else { return Err(lost(&name)) };
        let before = device.switches().clone();
        let after = SwitchPositions {
            rotary: switch.rotary.unwrap_or(before.rotary),
            dip: switch.dip.clone().unwrap_or_else(|| before.dip.clone()),
            termination: switch.termination.unwrap_or(before.termination),
        };
        if after == before {
            return Ok("the switches stand so already".to_owned());
        }
        device.set_switches(after.clone());
        let waits = device.powered().is_some()
            && (after.rotary, &after.dip) != (before.rotary, &before.dip);
        let [tens, units] = after.rotary;
        let mut text = format!("the rotary switches are at {tens} and {units}");
        for (dip, on) in B::DIP.iter().zip(&after.dip) {
            text.push_str(&format!(", DIP {} {}", dip.label, if *on { "ON" } else { "OFF" }));
        }
        let termination = if after.termination { "ON" } else { "OFF" };
        text.push_str(&format!(", the termination {termination}"));
        self.tell(now, place, text.clone(), medium);
        if after.termination != before.termination {
            medium.set_terminated(place, after.termination);
            for warning in medium.warnings() {
                self.report(now, What::Wiring(warning));
            }
        }
        if waits {
            text.push_str("; address and rate are read at the next power-up");
        }
        Ok(text)
    }

    fn begin(
        &mut self,
        now: Instant,
        place: usize,
        words: &str,
        medium: &mut impl Medium<B>,
    ) -> Result<String, Refusal> {
        let Some(device) = self.device(place, medium) else {
            return Err(lost(&self.devices[place].name));
        };
        let outfit = device.outfit();
        let lever = lever_of_words(words, outfit.product, &outfit.sensor, outfit.simulated)
            .map_err(|why| {
                Refusal::new(
                    Cause::Value,
                    format!("cannot begin {words:?}: {why}; nothing was done"),
                )
            })?;
        if let Lever::PowerCut(_) = lever
            && self.devices[place].unplugged.is_some()
        {
            let text = "the device has no power already: switch it on first";
            return Err(Refusal::new(Cause::State, text));
        }
        // The end of an earlier fault of this kind is not that of this one.
        self.agenda.forget_end(place, &lever);
        self.pull(now, place, Action::Begin(lever), medium);
        if let Some(lasts) = lever.lasts() {
            self.agenda.add(now + lasts, place, Action::End(lever));
        }
        Ok(lever.to_string())
    }

    fn end(
        &mut self,
        now: Instant,
        place: usize,
        kind: &str,
        medium: &mut impl Medium<B>,
    ) -> Result<String, Refusal> {
        let Some((like, end)) = fault_kinds::end_of(kind) else {
            let kinds: Vec<_> = fault_kinds::names().collect();
            let text = format!("there is no fault {kind:?}: there is {}", kinds.join(", "));
            return Err(Refusal::new(Cause::Unknown, text));
        };
        let Some(end) = end else {
            let text = format!("a {kind} is over at once: there is nothing to end");
            return Err(Refusal::new(Cause::Impossible, text));
        };
        if !self.faults(place, medium).contains(&kind) {
            let name = &self.devices[place].name;
            let text = format!("{name} has no {kind} now: there is nothing to end");
            return Err(Refusal::new(Cause::State, text));
        }
        let action = match end {
            End::Released => Action::End(like),
            End::By(lever) => Action::Begin(lever),
        };
        self.agenda.forget_end(place, &like);
        self.pull(now, place, action, medium);
        Ok(format!("{kind} is over"))
    }

    /// The kinds of faults that a device has now.
    pub(super) fn faults(&self, place: usize, medium: &impl Medium<B>) -> Vec<&'static str> {
        let mut faults = Vec::new();
        if let Some(device) = self.device(place, medium) {
            device.faults(&mut faults);
        }
        if let Some(hand) = self.devices.get(place) {
            faults.extend(hand.cut.then_some("power-cut"));
            faults.extend(hand.bad_transceiver.then_some("bad-transceiver"));
        }
        faults
    }

    /// The first master that serves a device, and the address it has now.
    pub(super) fn master_of(&self, place: usize, medium: &impl Medium<B>) -> Option<(usize, u8)> {
        use crate::field_bus::PlannedMaster;
        let positions = self.device(place, medium)?.switches_at_power_up();
        let address = B::Switches::at(positions).address()?;
        let serves = |chief: &super::Chief<B>| chief.plan.serves(address);
        Some((self.masters.iter().position(serves)?, address))
    }

    fn master_mut<'a>(
        &self,
        place: usize,
        medium: &'a mut impl Medium<B>,
    ) -> Option<&'a mut B::Master> {
        match medium.station_mut(self.devices.len() + place)? {
            Member::Master(master) => Some(master),
            Member::Device(_) => None,
        }
    }

    /// Reports what people have done to a device.
    fn tell(&mut self, now: Instant, place: usize, what: String, medium: &mut impl Medium<B>) {
        if let Some(device) = self.device_mut(place, medium) {
            device.report(now, What::Hand(what));
        }
    }

    /// Takes the power of a device away, where it has some.
    pub(super) fn cut_power(&mut self, now: Instant, place: usize, medium: &mut impl Medium<B>) {
        let Some(hand) = self.devices.get_mut(place).filter(|hand| hand.unplugged.is_none()) else {
            return;
        };
        hand.unplugged = medium.unplug(place);
        if let Some(device) = hand.unplugged.as_mut().and_then(Member::device_mut) {
            device.power_cut(now);
        }
    }

    /// Gives a device power, where it has none.
    pub(super) fn give_power(&mut self, now: Instant, place: usize, medium: &mut impl Medium<B>) {
        let Some(hand) = self.devices.get_mut(place) else { return };
        let Some(mut member) = hand.unplugged.take() else { return };
        if let Some(device) = member.device_mut() {
            device.power_up(now);
            medium.label(place, device.label(), device.switches().termination);
        }
        medium.plug_in(place, member);
        if let Some(station) = medium.station_mut(place) {
            station.advance(now);
        }
    }
}

/// A device that is nowhere, which is a bug of this crate and no reason to panic.
pub(super) fn lost(name: &str) -> Refusal {
    Refusal::new(Cause::Failed, format!("{name} cannot be found on its bus: start the plant anew"))
}

impl crate::fault::Agenda {
    /// Does something later.
    fn add(&mut self, at: Instant, place: usize, action: Action) {
        let before = self.steps.partition_point(|(other, ..)| *other <= at);
        self.steps.insert(before, (at, place, action));
    }

    /// Ends a fault of this kind no more, where it has begun.
    fn forget_end(&mut self, place: usize, lever: &Lever) {
        let kind = |action: &Action| {
            let (Action::Begin(other) | Action::End(other)) = action;
            discriminant(other) == discriminant(lever)
        };
        let mut steps = self.steps.iter();
        let next = steps.position(|(_, of, action)| *of == place && kind(action));
        if let Some(next) = next
            && matches!(self.steps.get(next), Some((_, _, Action::End(_))))
        {
            self.steps.remove(next);
        }
    }
}
