// what a page has beyond HTML: how a running step stands, and the command line of a form as it is filled in
const progress = document.getElementById("progress");
if (progress) {
  const look = async () => {
    const answer = await fetch(`/step/${progress.dataset.step}?only=state`);
    const { status, progress: text } = await answer.json();
    if (status !== "running") location.reload();
    if (progress.textContent !== text) progress.textContent = text;
    setTimeout(look, 1000);
  };
  setTimeout(look, 500);
}
const form = document.getElementById("give");
if (form) {
  const line = document.getElementById("line");
  const tell = async () => {
    const body = new URLSearchParams(new FormData(form));
    const answer = await fetch(`${form.getAttribute("action")}?only=line`, { method: "POST", body });
    line.textContent = answer.headers.get("Content-Type")?.includes("json") ? (await answer.json()).line : "";
  };
  form.addEventListener("change", tell);
  tell();
}
