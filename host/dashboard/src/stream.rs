//! The events of a plant, as they happen: server-sent events.

use std::collections::{HashMap, VecDeque};
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::response::sse::{Event, KeepAlive, Sse};
use codewheel_plant::{ObjectGroup, Refusal, Running, Trace};
use futures_util::Stream;
use futures_util::stream::unfold;
use serde::{Deserialize, Serialize};
use tokio::task::JoinHandle;
use tokio::time::Instant;
use utoipa::{IntoParams, ToSchema};

use crate::feed::{READERS, Reader};
use crate::problem::Problem;
use crate::server::Shared;
use crate::view::{GroupDocument, ReportDocument, StateDocument, TraceDocument, ValueDocument};

/// How often the objects of a device are read.
const OBJECTS: Duration = Duration::from_millis(200);
/// How often a silent stream says that it is alive.
const KEEP: Duration = Duration::from_secs(15);
/// After how long a browser tries again.
const RETRY: Duration = Duration::from_secs(1);
const RATE: u32 = 20;

/// What a stream tells.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct Wanted {
    /// Also the objects of this device, `BUS/DEVICE`, when they change.
    device: Option<String>,
    /// Also what this bus carries.
    trace: Option<String>,
    /// Messages of a kind a second, at most.
    #[param(minimum = 1, maximum = 20, default = 20)]
    rate: Option<u32>,
}

/// What the events hold, each as JSON behind `data:`.
#[derive(Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[allow(dead_code, reason = "it only documents what the stream writes")]
pub(crate) enum EventDocument {
    /// `event: state`: first the whole state, then merge patches (RFC 7396) with what has changed.
    State(StateDocument),
    /// `event: reports`: what has happened before, once.
    Reports(Vec<ReportDocument>),
    /// `event: report`: what happens.
    Report(ReportDocument),
    /// `event: objects`: the values of the objects by key, first all, then those that have changed.
    #[schema(value_type = HashMap<String, ValueDocument>)]
    Objects(HashMap<String, Option<ValueDocument>>),
    /// `event: trace`: what the bus carries.
    Trace(TraceDocument),
}

/// The state of the plant and what happens in it, as it changes.
///
/// The first `state` is whole; those that follow are merge patches against the state before. Whoever
/// reads slowly gets fewer and larger ones.
#[utoipa::path(
    get,
    path = "/api/v1/events",
    tag = "plant",
    params(Wanted),
    responses(
        (status = 200, description = "Events without end", body = EventDocument, content_type = "text/event-stream"),
        (status = 404, description = "No such bus or device", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "No such rate", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "Too many streams", body = Problem, content_type = "application/problem+json"),
    )
)]
pub(crate) async fn events(
    State(shared): State<Arc<Shared>>,
    wanted: Result<Query<Wanted>, axum::extract::rejection::QueryRejection>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Problem> {
    let Query(wanted) = wanted.map_err(|error| Problem::nonsense(error.body_text()))?;
    let rate = wanted.rate.unwrap_or(RATE);
    if !(1..=RATE).contains(&rate) {
        return Err(Problem::nonsense(format!("rate={rate}: write 1 to {RATE} messages a second")));
    }
    let plant = &shared.plant;
    let trace = wanted.trace.map(|bus| plant.trace(&bus)).transpose().map_err(Problem::from)?;
    let objects = match wanted.device {
        Some(device) => Some(Objects::of(plant, &device)?),
        None => None,
    };
    let reader = shared.feed.read().ok_or_else(|| {
        Problem::new(
            "too-many-streams",
            StatusCode::SERVICE_UNAVAILABLE,
            "Too many are watching",
            format!("{READERS} streams of events are open: close a page, or end a program"),
        )
    })?;
    let stream = EventStream {
        reader,
        objects,
        trace,
        pause: Duration::from_secs(1) / rate,
        next: Instant::now(),
        waiting: VecDeque::new(),
        is_first: true,
    };
    let events = unfold(stream, |mut stream| async {
        let event = stream.next().await;
        Some((Ok(event), stream))
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP).text("keep")))
}

/// What one reader is told. It is only asked for more when what was told has left, so what waits
/// for a slow reader is the newest, and little.
struct EventStream {
    reader: Reader,
    objects: Option<Objects>,
    trace: Option<Trace>,
    /// Between two messages of a kind.
    pause: Duration,
    /// When there may be more.
    next: Instant,
    /// Gathered, but not told.
    waiting: VecDeque<Event>,
    is_first: bool,
}

impl EventStream {
    async fn next(&mut self) -> Event {
        loop {
            if let Some(event) = self.waiting.pop_front() {
                return event;
            }
            self.reader.changed().await;
            tokio::time::sleep_until(self.next).await;
            // In the long run no more than was asked for; one that came late is not made up for.
            self.next = (self.next + self.pause).max(Instant::now());
            self.gather();
        }
    }

    fn gather(&mut self) {
        if let Some(text) = self.reader.state() {
            let event = Event::default().event("state").data(text);
            let event = if self.is_first { event.retry(RETRY) } else { event };
            self.waiting.push_back(event);
        }
        let (reports, lost) = self.reader.reports();
        if std::mem::take(&mut self.is_first) {
            self.waiting.push_back(event("reports", &reports));
        } else {
            if lost > 0 {
                self.waiting.push_back(event("report", &ReportDocument::lost(lost)));
            }
            self.waiting.extend(reports.iter().map(|report| event("report", report)));
        }
        if let Some(trace) = &self.trace {
            let traced = trace.lines(Duration::ZERO);
            if !traced.lines.is_empty() || traced.lost > 0 {
                self.waiting.push_back(event("trace", &TraceDocument::from(traced)));
            }
        }
        if let Some(changed) = self.objects.as_mut().and_then(Objects::changed) {
            self.waiting.push_back(event("objects", &changed));
        }
    }
}

fn event(name: &str, document: &impl Serialize) -> Event {
    // Texts and numbers always become JSON.
    let data = serde_json::to_string(document).unwrap_or_default();
    Event::default().event(name).data(data)
}

/// The objects of one device, read again and again.
struct Objects {
    plant: Arc<Running>,
    bus: String,
    device: String,
    told: HashMap<String, Option<ValueDocument>>,
    reading: Option<JoinHandle<Result<Vec<ObjectGroup>, Refusal>>>,
    next: Instant,
}

impl Objects {
    fn of(plant: &Arc<Running>, path: &str) -> Result<Self, Problem> {
        // Names may have a slash in them, so the path is looked for among those there are.
        let mut devices = plant.descriptions().iter().flat_map(|bus| {
            bus.devices.iter().map(|device| (bus.name.as_str(), device.name.as_str()))
        });
        let found = devices.find(|(bus, device)| {
            path.strip_prefix(bus).and_then(|rest| rest.strip_prefix('/')) == Some(device)
        });
        let (bus, device) = found.ok_or_else(|| {
            Problem::not_found(format!(
                "device={path}: there is no such device; write BUS/DEVICE with the names of \
                 /api/v1/plant"
            ))
        })?;
        Ok(Self {
            plant: Arc::clone(plant),
            bus: bus.to_owned(),
            device: device.to_owned(),
            told: HashMap::new(),
            reading: None,
            next: Instant::now(),
        })
    }

    /// What has changed, where a reading has come to its end; and begins the next one.
    fn changed(&mut self) -> Option<HashMap<String, Option<ValueDocument>>> {
        use futures_util::FutureExt;
        let done = self.reading.as_mut().and_then(FutureExt::now_or_never);
        if done.is_some() {
            self.reading = None;
        }
        if self.reading.is_none() && Instant::now() >= self.next {
            self.next = Instant::now() + OBJECTS;
            let (plant, bus, device) =
                (Arc::clone(&self.plant), self.bus.clone(), self.device.clone());
            let read = move || plant.objects(&bus, &device);
            self.reading = Some(tokio::task::spawn_blocking(read));
        }
        // A bus that has stopped has nothing to tell any more.
        let groups = done?.ok()?.ok()?;
        let objects = groups.iter().map(GroupDocument::from).flat_map(|group| group.objects);
        let mut changed = HashMap::new();
        for object in objects {
            if self.told.get(&object.key) != Some(&object.value) {
                self.told.insert(object.key.clone(), object.value.clone());
                changed.insert(object.key, object.value);
            }
        }
        (!changed.is_empty()).then_some(changed)
    }
}
