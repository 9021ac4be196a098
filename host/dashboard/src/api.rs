//! What can be asked of a plant, and done to it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::body::Bytes;
use axum::extract::rejection::PathRejection;
use axum::extract::{FromRequest, FromRequestParts, Path, Request, State};
use axum::http::StatusCode;
use axum::http::request::Parts;
use axum::response::{IntoResponse, Response};
use codewheel_plant::{Cause, Command, Refusal, Switch};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::Problem;
use crate::server::Shared;
use crate::stream;
use crate::view::{GroupDocument, PlantDocument, ValueDocument};

/// The largest body of a request, in octets.
pub(crate) const BODY: usize = 64 * 1024;
/// How long a body may be under way.
const BODY_LASTS: Duration = Duration::from_secs(10);

/// Every route of the API, each with its part of the document that describes it.
pub(crate) fn routes() -> OpenApiRouter<Arc<Shared>> {
    OpenApiRouter::new()
        .routes(routes!(openapi))
        .routes(routes!(plant))
        .routes(routes!(stream::events))
        .routes(routes!(objects))
        .routes(routes!(write_object))
        .routes(routes!(move_shaft))
        .routes(routes!(switch_power))
        .routes(routes!(turn_switches))
        .routes(routes!(begin_fault))
        .routes(routes!(end_fault))
        .routes(routes!(preset))
        .routes(routes!(save))
        .routes(routes!(restore))
        .routes(routes!(reset))
}

/// What a command has done.
#[derive(Serialize, ToSchema)]
struct DoneDocument {
    /// Always true.
    ok: bool,
    /// What was done.
    message: String,
}

/// Moves the shaft; one of these.
#[derive(Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum ShaftOrder {
    /// By so many raw steps, clockwise where positive.
    By(i64),
    /// To where the sensor has this raw code, the shorter way.
    To(u32),
    /// As this says, from where it is: `turn rpm=60`, `sine amplitude=90deg period=2s`.
    Motion(String),
    /// Not any more: true.
    Stop(bool),
}

#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct PowerOrder {
    on: bool,
}

/// Turns switches; what is left out stays as it is.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct SwitchOrder {
    /// The tens and the units of the address, 0 to 9 each.
    rotary: Option<[u8; 2]>,
    /// DIP switches 1, 2, …, true for ON.
    dip: Option<Vec<bool>>,
    /// The terminating resistor.
    termination: Option<bool>,
}

/// Lets something go wrong.
#[derive(Deserialize, ToSchema)]
struct FaultOrder {
    /// One of the kinds that the plant lists for the device: `late-answers`.
    kind: String,
    /// Its parameters by name: `"delay": "20ms"`.
    #[serde(flatten)]
    parameters: BTreeMap<String, Value>,
}

#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct WriteOrder {
    value: ValueDocument,
}

#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct PresetOrder {
    /// The position that is to be here.
    value: u32,
}

/// Which device.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
struct Device {
    /// The name of the bus.
    bus: String,
    /// The name of the device.
    device: String,
}

/// Which object of which device.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
struct ObjectOfDevice {
    /// The name of the bus.
    bus: String,
    /// The name of the device.
    device: String,
    /// The key of the object.
    key: String,
}

/// Which fault of which device.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Path)]
struct FaultOfDevice {
    /// The name of the bus.
    bus: String,
    /// The name of the device.
    device: String,
    /// The kind of the fault.
    kind: String,
}

/// What the path says, refused in our own way.
struct Named<T>(T);

/// What the body says, refused in our own way.
struct Asked<T>(T);

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for Named<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let named = Path::<T>::from_request_parts(parts, state).await;
        let Path(named) =
            named.map_err(|error: PathRejection| Problem::not_found(error.body_text()))?;
        Ok(Self(named))
    }
}

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for Asked<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        let path = request.uri().path().to_owned();
        let body = tokio::time::timeout(BODY_LASTS, Bytes::from_request(request, state)).await;
        let body = body.map_err(|_| {
            Problem::new(
                "slow",
                StatusCode::REQUEST_TIMEOUT,
                "The request is too slow",
                format!("{path}: its body has not come within {BODY_LASTS:?}: send it at once"),
            )
        })?;
        let body = body.map_err(|error| {
            let text = error.body_text();
            match error.status() {
                StatusCode::PAYLOAD_TOO_LARGE => Problem::new(
                    "too-large",
                    StatusCode::PAYLOAD_TOO_LARGE,
                    "The request is too large",
                    format!("{path}: a body has at most {BODY} octets"),
                ),
                _ => Problem::nonsense(format!("{path}: {text}")),
            }
        })?;
        serde_json::from_slice(&body).map(Self).map_err(|error| {
            Problem::nonsense(format!(
                "{path}: {error}; /api/v1/openapi.json says what can be sent"
            ))
        })
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Self {
        let (kind, status, title) = match refusal.cause {
            Cause::Unknown => return Self::not_found(refusal.text),
            Cause::Value => return Self::nonsense(refusal.text),
            Cause::State => ("not-now", StatusCode::CONFLICT, "This cannot be done now"),
            Cause::Impossible => ("impossible", StatusCode::CONFLICT, "This cannot be done"),
            Cause::Failed => {
                ("failed", StatusCode::INTERNAL_SERVER_ERROR, "The device tried and failed")
            }
            Cause::Busy => ("busy", StatusCode::TOO_MANY_REQUESTS, "The bus is busy"),
            Cause::Late => ("late", StatusCode::GATEWAY_TIMEOUT, "No answer came in time"),
            Cause::Stopped => ("stopped", StatusCode::SERVICE_UNAVAILABLE, "The bus has stopped"),
        };
        Self::new(kind, status, title, refusal.text)
    }
}

/// This document.
#[utoipa::path(
    get,
    path = "/api/v1/openapi.json",
    tag = "plant",
    responses((status = 200, description = "OpenAPI 3.1", body = Object, content_type = "application/json"))
)]
async fn openapi(State(shared): State<Arc<Shared>>) -> Response {
    Json(&shared.openapi).into_response()
}

/// What does not change while the plant runs: buses, devices, masters.
#[utoipa::path(
    get,
    path = "/api/v1/plant",
    tag = "plant",
    responses((status = 200, description = "The plant", body = PlantDocument))
)]
async fn plant(State(shared): State<Arc<Shared>>) -> Json<PlantDocument> {
    let read_only = shared.gate.is_read_only();
    Json(PlantDocument::new(&shared.name, read_only, shared.plant.descriptions()))
}

/// All that can be read of a device and set, with the values of now.
#[utoipa::path(
    get,
    path = "/api/v1/buses/{bus}/devices/{device}/objects",
    tag = "objects",
    params(Device),
    responses(
        (status = 200, description = "The objects", body = [GroupDocument]),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn objects(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
) -> Result<Json<Vec<GroupDocument>>, Problem> {
    let plant = Arc::clone(&shared.plant);
    let groups = waited_for(move || plant.objects(&at.bus, &at.device)).await?;
    Ok(Json(groups.iter().map(GroupDocument::from).collect()))
}

/// Writes an object.
#[utoipa::path(
    put,
    path = "/api/v1/buses/{bus}/devices/{device}/objects/{key}",
    tag = "objects",
    params(ObjectOfDevice),
    request_body = WriteOrder,
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn write_object(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<ObjectOfDevice>,
    Asked(order): Asked<WriteOrder>,
) -> Result<Json<DoneDocument>, Problem> {
    let ObjectOfDevice { bus, device, key } = at;
    let command = Command::Write { key, value: order.value.into() };
    done(&shared, Device { bus, device }, command).await
}

/// Moves the shaft.
#[utoipa::path(
    post,
    path = "/api/v1/buses/{bus}/devices/{device}/shaft",
    tag = "hands",
    params(Device),
    request_body = ShaftOrder,
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn move_shaft(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
    Asked(order): Asked<ShaftOrder>,
) -> Result<Json<DoneDocument>, Problem> {
    let command = match order {
        ShaftOrder::By(steps) => Command::TurnBy(steps),
        ShaftOrder::To(code) => Command::TurnTo(code),
        ShaftOrder::Motion(text) => Command::Motion(text),
        ShaftOrder::Stop(true) => Command::Stop,
        ShaftOrder::Stop(false) => {
            return Err(Problem::nonsense(
                "\"stop\": false says nothing: send \"stop\": true, or a motion to start one",
            ));
        }
    };
    done(&shared, at, command).await
}

/// Switches the device on or off.
#[utoipa::path(
    put,
    path = "/api/v1/buses/{bus}/devices/{device}/power",
    tag = "hands",
    params(Device),
    request_body = PowerOrder,
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn switch_power(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
    Asked(order): Asked<PowerOrder>,
) -> Result<Json<DoneDocument>, Problem> {
    done(&shared, at, Command::Power(order.on)).await
}

/// Turns switches of the bus cover. The terminating resistor acts at once, the others at the next
/// power-up.
#[utoipa::path(
    put,
    path = "/api/v1/buses/{bus}/devices/{device}/switches",
    tag = "hands",
    params(Device),
    request_body = SwitchOrder,
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn turn_switches(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
    Asked(order): Asked<SwitchOrder>,
) -> Result<Json<DoneDocument>, Problem> {
    let SwitchOrder { rotary, dip, termination } = order;
    done(&shared, at, Command::Switch(Switch { rotary, dip, termination })).await
}

/// Lets something go wrong.
#[utoipa::path(
    post,
    path = "/api/v1/buses/{bus}/devices/{device}/faults",
    tag = "faults",
    params(Device),
    request_body = FaultOrder,
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn begin_fault(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
    Asked(order): Asked<FaultOrder>,
) -> Result<Json<DoneDocument>, Problem> {
    let words = order.words()?;
    done(&shared, at, Command::Begin(words)).await
}

/// Ends a fault.
#[utoipa::path(
    delete,
    path = "/api/v1/buses/{bus}/devices/{device}/faults/{kind}",
    tag = "faults",
    params(FaultOfDevice),
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn end_fault(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<FaultOfDevice>,
) -> Result<Json<DoneDocument>, Problem> {
    let FaultOfDevice { bus, device, kind } = at;
    done(&shared, Device { bus, device }, Command::End(kind)).await
}

/// Makes a value the position of now.
#[utoipa::path(
    post,
    path = "/api/v1/buses/{bus}/devices/{device}/preset",
    tag = "objects",
    params(Device),
    request_body = PresetOrder,
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn preset(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
    Asked(order): Asked<PresetOrder>,
) -> Result<Json<DoneDocument>, Problem> {
    done(&shared, at, Command::Preset(order.value)).await
}

/// Keeps the settings in force through a power cut.
#[utoipa::path(
    post,
    path = "/api/v1/buses/{bus}/devices/{device}/save",
    tag = "objects",
    params(Device),
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn save(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
) -> Result<Json<DoneDocument>, Problem> {
    done(&shared, at, Command::Save).await
}

/// Brings the kept settings back into force.
#[utoipa::path(
    post,
    path = "/api/v1/buses/{bus}/devices/{device}/restore",
    tag = "objects",
    params(Device),
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn restore(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
) -> Result<Json<DoneDocument>, Problem> {
    done(&shared, at, Command::Restore).await
}

/// Brings the settings of a new device into force, unsaved.
#[utoipa::path(
    post,
    path = "/api/v1/buses/{bus}/devices/{device}/reset",
    tag = "objects",
    params(Device),
    responses(
        (status = 200, description = "Done", body = DoneDocument),
        (status = "default", description = "Not done", body = Problem, content_type = "application/problem+json"),
    )
)]
async fn reset(
    State(shared): State<Arc<Shared>>,
    Named(at): Named<Device>,
) -> Result<Json<DoneDocument>, Problem> {
    done(&shared, at, Command::Reset).await
}

async fn done(
    shared: &Shared,
    at: Device,
    command: Command,
) -> Result<Json<DoneDocument>, Problem> {
    let plant = Arc::clone(&shared.plant);
    let done = waited_for(move || plant.command(&at.bus, &at.device, command)).await?;
    Ok(Json(DoneDocument { ok: true, message: done.to_string() }))
}

/// Waits for the thread of a bus, without holding up other requests.
async fn waited_for<T: Send + 'static>(
    ask: impl FnOnce() -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Problem> {
    let answer = tokio::task::spawn_blocking(ask).await.map_err(|error| {
        Problem::new(
            "broken",
            StatusCode::INTERNAL_SERVER_ERROR,
            "The program is broken",
            format!("the command has ended in an error of the program: {error}; please report it"),
        )
    })?;
    Ok(answer?)
}

impl FaultOrder {
    /// The words of plant files: `jump steps=4000`.
    ///
    /// # Errors
    /// What cannot be a word.
    fn words(&self) -> Result<String, Problem> {
        let mut words = word("kind", &self.kind)?.to_owned();
        for (name, value) in &self.parameters {
            let value = match value {
                // Left out on purpose, as an empty field of a form is.
                Value::Null => continue,
                Value::String(text) => word(name, text)?.to_owned(),
                Value::Number(number) => number.to_string(),
                Value::Bool(on) => on.to_string(),
                Value::Array(_) | Value::Object(_) => {
                    return Err(Problem::nonsense(format!("{name}: write a number or a text")));
                }
            };
            words.push_str(&format!(" {}={value}", word("a parameter", name)?));
        }
        Ok(words)
    }
}

/// A text that stays one word, so that nobody writes two parameters into one.
fn word<'a>(name: &str, text: &'a str) -> Result<&'a str, Problem> {
    let is_word = !text.is_empty() && !text.contains(|c: char| c.is_whitespace() || c == '=');
    is_word.then_some(text).ok_or_else(|| {
        Problem::nonsense(format!("{name}: {text:?} is not one word, such as 20ms or 4000"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(body: &str) -> Result<String, Problem> {
        serde_json::from_str::<FaultOrder>(body).expect("an order").words()
    }

    #[test]
    fn a_fault_and_its_parameters_become_words_of_plant_files() {
        assert_eq!(words(r#"{"kind":"stuck"}"#).as_deref(), Ok("stuck"));
        assert_eq!(
            words(r#"{"kind":"drop-answers","probability":0.5,"count":3,"for":"5s","x":null}"#)
                .as_deref(),
            Ok("drop-answers count=3 for=5s probability=0.5")
        );
    }

    #[test]
    fn a_body_that_does_not_come_is_not_waited_for_for_ever() {
        let pending = futures_util::stream::pending::<Result<Bytes, std::io::Error>>();
        let request = Request::new(axum::body::Body::from_stream(pending));
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = runtime.enable_time().start_paused(true).build().expect("a runtime");
        let asked = runtime.block_on(Asked::<PowerOrder>::from_request(request, &()));
        let problem = asked.err().expect("no body");
        assert_eq!(problem.status(), StatusCode::REQUEST_TIMEOUT);
    }

    #[test]
    fn no_parameter_smuggles_another_one_in() {
        for body in [
            r#"{"kind":"jump at=3s"}"#,
            r#"{"kind":"jump","steps":"5 at=3s"}"#,
            r#"{"kind":"jump","steps=5 at":"3s"}"#,
            r#"{"kind":"jump","steps":""}"#,
            r#"{"kind":"jump","steps":[5]}"#,
        ] {
            assert!(words(body).is_err(), "{body}");
        }
    }
}
