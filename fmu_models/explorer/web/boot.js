// Unpacks what stands in the page as compressed bytes; the policy knows the hash of the script that comes out.
function unpacked(id) {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent.trim()), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
}

function refuse(why) {
  document.getElementById("live").hidden = true;
  document.getElementById("still").hidden = false;
  document.getElementById("why").textContent = `The motion cannot be computed here: ${why}.`;
}

if (typeof WebAssembly !== "object" || typeof DecompressionStream !== "function") refuse("this browser has no WebAssembly");
else unpacked("script").text().then((text) => {
  const script = document.createElement("script");
  script.type = "module";
  script.textContent = text;
  document.head.append(script);
}).catch((error) => refuse(error.message));
