// What the pages of mdBook lack for keyboards and screen readers.
for (const bar of document.querySelectorAll(".menu-bar")) bar.setAttribute("role", "banner");
// The toggle of the table of contents is a label, which no keyboard reaches.
for (const label of document.querySelectorAll("label.icon-button")) {
    const box = document.getElementById(label.htmlFor);
    const button = document.createElement("button");
    for (const { name, value } of label.attributes) if (name !== "for") button.setAttribute(name, value);
    button.append(...label.childNodes);
    button.addEventListener("click", () => {
        box.click();
        button.setAttribute("aria-expanded", box.checked);
    });
    label.replaceWith(button);
}
for (const box of document.querySelectorAll("pre > code, .table-wrapper")) {
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
}
// A table's empty corner is no heading.
for (const corner of document.querySelectorAll("th:empty")) corner.replaceWith(document.createElement("td"));
