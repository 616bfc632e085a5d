// Tells the studio where a pointer is on the camera's image, in shares of its sides. viser's images take no pointers.
if (!window.mirrorgazePointing) {
  window.mirrorgazePointing = true;
  const page = crypto.getRandomValues(new Uint32Array(1))[0];
  const waiting = [];
  let held = null;
  let sending = false;

  const send = async () => {
    sending = true;
    while (waiting.length) {
      await fetch("/pointed?" + new URLSearchParams(waiting.shift())).catch(() => {});
    }
    sending = false;
  };

  const tell = (phase, event) => {
    const image = held.getBoundingClientRect();
    const x = (event.clientX - image.left) / image.width;
    const y = (event.clientY - image.top) / image.height;
    // Of the moves that wait only the newest counts.
    if (phase === "move" && waiting.at(-1)?.phase === "move") waiting.pop();
    waiting.push({ page, phase, x, y });
    if (!sending) send();
  };

  // The enlarged image is another element with the same address.
  const onImage = (event) => event.target instanceof HTMLImageElement && event.target.src.startsWith("blob:");

  document.addEventListener("dragstart", (event) => onImage(event) && event.preventDefault());
  document.addEventListener("pointerdown", (event) => {
    if (!onImage(event) || event.button !== 0 || !event.isPrimary) return;
    held = event.target;
    held.setPointerCapture(event.pointerId);
    tell("down", event);
  });
  document.addEventListener("pointermove", (event) => held && event.isPrimary && tell("move", event));
  for (const end of ["pointerup", "pointercancel"]) {
    document.addEventListener(end, (event) => {
      if (!held || !event.isPrimary) return;
      tell(end === "pointerup" ? "up" : "cancel", event);
      held = null;
    });
  }
}
