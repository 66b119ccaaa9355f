// what a page has beyond HTML: how a running step stands, the command line of a form as it is filled in, a place in a
// picture, and that something was sent
const byId = (name) => document.getElementById(name);
// null where nobody answers: the studio was ended, or the page is left
const ask = (place, options) => fetch(place, options).catch(() => null);
const progress = byId("progress");
if (progress) {
  const look = async () => {
    const answer = await ask(`/step/${progress.dataset.step}?only=state`);
    const none = { status: "running", progress: "No answer. Does the studio still run in its terminal?", seconds: 0 };
    const { status, progress: text, seconds } = answer ? await answer.json() : none;
    if (status !== "running") location.reload();
    if (progress.textContent !== text) progress.textContent = text;
    byId("seconds").textContent = Math.round(seconds);
    setTimeout(look, 1000);
  };
  setTimeout(look, 500);
}
const form = byId("give");
if (form) {
  const tell = async () => {
    const body = new URLSearchParams(new FormData(form));
    const answer = await ask(`${form.getAttribute("action")}?only=line`, { method: "POST", body });
    if (!answer) return;
    const isLine = answer.headers.get("Content-Type")?.includes("json");
    byId("line").textContent = isLine ? (await answer.json()).line : "(something that is needed is empty)";
  };
  let soon;
  form.addEventListener("input", () => {
    clearTimeout(soon);
    soon = setTimeout(tell, 200);
  });
  tell();
}
const picture = byId("place");
if (picture) {
  const [left, low, right, high] = JSON.parse(picture.dataset.box);
  const mark = Object.assign(document.createElement("span"), { className: "mark", hidden: true });
  picture.after(mark);
  picture.addEventListener("click", (event) => {
    const { x, y, width, height } = picture.getBoundingClientRect();
    const [u, v] = [(event.clientX - x) / width, (event.clientY - y) / height];
    const shares = [(u - left) / (right - left), (low - v) / (low - high)];
    if (shares.some((share) => share < 0 || share > 1)) return;
    JSON.parse(picture.dataset.limits).forEach(([from, to], i) => {
      byId(`at${i + 1}`).value = Number((from + shares[i] * (to - from)).toPrecision(5));
    });
    Object.assign(mark.style, { left: `${100 * u}%`, top: `${100 * v}%` });
    mark.hidden = false;
  });
}
for (const files of document.querySelectorAll("[data-largest]")) {
  files.addEventListener("change", () => {
    const size = [...files.files].reduce((sum, { size }) => sum + size, 0);
    const most = Number(files.dataset.largest);
    files.setCustomValidity(size > most ? `More than ${most >> 20} MB: copy them into the folder of the study.` : "");
    files.reportValidity();
  });
}
document.addEventListener("submit", ({ submitter }) => {
  if (submitter) submitter.textContent += " …";
});
