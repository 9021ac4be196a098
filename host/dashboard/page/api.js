/** @file The requests of the page. Each command is answered in words, whatever comes of it. */

const BASE = "api/v1";

/** A command that was not carried out. `message` says what was tried, what came back, what to do. */
export class Refusal extends Error {}

/** What does not change while the plant runs. */
export function fetchPlant() {
  return request("GET", "plant");
}

/** The objects, or octets, of a device, in groups. */
export function fetchObjects(place) {
  return request("GET", `${devicePath(place)}/objects`);
}

/**
 * Sends a command to a device.
 * @param {{bus: string, device: string}} place
 * @param {"POST"|"PUT"|"DELETE"} method
 * @param {string} path below the device, as `power` or `objects/steps-per-turn`
 * @param {object} [body]
 * @returns {Promise<string>} what was done, in words
 * @throws {Refusal}
 */
export async function command(place, method, path, body = {}) {
  const answer = await request(method, `${devicePath(place)}/${path}`, body);
  return answer?.message || "Done.";
}

/** The address of the event stream. `wants.device` is `BUS/DEVICE`, `wants.trace` a bus. */
export function eventsAddress(wants) {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries(wants)) if (value) query.set(name, value);
  return `${BASE}/events?${query}`;
}

function devicePath({ bus, device }) {
  return `buses/${encodeURIComponent(bus)}/devices/${encodeURIComponent(device)}`;
}

async function request(method, path, body) {
  const options = { method, headers: { Accept: "application/json" } };
  if (body !== undefined) {
    options.headers["Content-Type"] = "application/json";
    options.body = JSON.stringify(body);
  }
  let response;
  try {
    response = await fetch(`${BASE}/${path}`, options);
  } catch {
    throw new Refusal("The plant does not answer: is codewheel still running?");
  }
  let answer = null;
  try {
    answer = await response.json();
  } catch {
    // Told below, by its status.
  }
  if (response.ok && answer !== null) return answer;
  const told = answer?.detail || answer?.title || "and said no more";
  throw new Refusal(answer?.detail ? told : `The plant answered ${response.status}, ${told}.`);
}
