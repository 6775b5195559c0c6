// A magnifying glass over all three pictures at once. The report says all of it without, too.
const ZOOM = 12, PIXELS = 15;
for (const three of document.querySelectorAll(".three")) {
  const width = +three.dataset.width, height = +three.dataset.height, page = +three.dataset.page;
  const views = [...three.querySelectorAll(".view")];
  const lenses = views.map(() => {
    const lens = document.createElement("div");
    lens.className = "lens";
    lens.ariaHidden = "true";
    lens.append(document.createElement("div"), document.createElement("span"));
    return lens;
  });
  const hide = () => lenses.forEach((lens) => lens.remove());
  const show = (event) => {
    if (event.pointerType === "touch") return;
    const area = event.currentTarget.getBoundingClientRect();
    const x = Math.floor((event.clientX - area.left) / area.width * width);
    const y = Math.floor((event.clientY - area.top) / area.height * height);
    if (x < 0 || y < 0 || x >= width || y >= height) return hide();
    let place = `plane ${x & 3}, x ${x}, y ${y}`;
    if (page) {
      const address = (y * width + x) >> 2, n = Math.floor(y / page);
      // The last line is not whole.
      if (address > 0xffff) return hide();
      place = `plane ${x & 3}, address ${address.toString(16).padStart(4, "0")}`;
      if ((n + 1) * page * width <= 4 * 65536) place += ` (page ${n})`;
    }
    const middle = (at) => (PIXELS >> 1) * ZOOM - at * ZOOM;
    views.forEach((view, i) => {
      const [glass, text] = lenses[i].children;
      glass.style.backgroundImage = `url("${view.querySelector("img").src}")`;
      glass.style.backgroundSize = `${width * ZOOM}px ${height * ZOOM}px`;
      glass.style.backgroundPosition = `${middle(x)}px ${middle(y)}px`;
      text.textContent = place;
      lenses[i].style.left = x < width / 2 ? "auto" : "8px";
      lenses[i].style.right = x < width / 2 ? "8px" : "auto";
      // Beside the pointer, and not beyond what is visible of a tall frame.
      const top = (event.clientY - area.top) / area.height * view.clientHeight - 90;
      lenses[i].style.top = `${Math.max(8, Math.min(view.clientHeight - 214, top))}px`;
      view.append(lenses[i]);
    });
  };
  for (const view of views) {
    view.addEventListener("pointermove", show);
    view.addEventListener("pointerleave", hide);
  }
}
