// What is said in words: mode, drives, contact, fault with its remedy.

const set = (id, text) => {
  const element = document.getElementById(id);
  if (element.textContent !== text) element.textContent = text;
};

const axes = (values, unit) =>
  values.every((v) => v === values[0])
    ? `${values[0].toFixed(1)} ${unit}`
    : `${values.map((v) => v.toFixed(1)).join(", ")} ${unit}`;

export const words = (name) => name.replaceAll("_", " ");

export function showState(frame) {
  set("mode", words(frame.mode));
  set("drives", frame.drives_active ? "active" : "idle");
  set("contact", frame.in_contact ? "yes" : "no");
  set("error", frame.tip_error_m === null ? "–" : `${(1e3 * frame.tip_error_m).toFixed(1)} mm`);
  set("force", `${Math.hypot(...frame.force_n).toFixed(1)} N`);
  set("missed", String(frame.missed));
  set("force-source", frame.force_is_measured ? " measured" : " observed, no sensor");
  set("stiffness-reported", axes(frame.stiffness_n_per_m, "N/m"));
  set("damping-reported", axes(frame.damping_n_s_per_m, "N s/m"));
  const fault = document.getElementById("fault");
  fault.hidden = frame.fault === null;
  if (frame.fault) {
    set("fault-text", `Fault: ${frame.fault.text || words(frame.fault.name)}`);
    set("fault-remedy", frame.fault.remedy);
  }
  for (const button of document.querySelectorAll("#commands [data-request]")) {
    const { request } = JSON.parse(button.dataset.request);
    button.classList.toggle("current", request !== "pendant" && request === frame.mode);
  }
}
