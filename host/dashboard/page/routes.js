/** @file The addresses of the views: `#/` is the overview, `#/BUS/DEVICE` an encoder. */

/** The address of an encoder's view. */
export function linkTo({ bus, device }) {
  return `#/${encodeURIComponent(bus)}/${encodeURIComponent(device)}`;
}

/** The encoder that an address names with its bus, or `null` for the overview. */
export function encoderAt(plant, hash) {
  const names = hash.replace(/^#\/?/, "").split("/").map(decode);
  const bus = plant.buses.find((one) => one.id === names[0]);
  const device = bus?.devices.find((one) => one.id === names[1]);
  return device ? { bus, device, place: { bus: bus.id, device: device.id } } : null;
}

function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}
