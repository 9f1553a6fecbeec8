// Marks in the navigation the section that is read.

export function markSections() {
    const links = new Map(
        [...document.querySelectorAll("#sections a")].map((link) => [link.hash.slice(1), link]),
    );
    const mark = (entries) => {
        for (const { isIntersecting, target } of entries) {
            if (!isIntersecting) continue;
            for (const [id, link] of links) {
                if (id === target.id) link.setAttribute("aria-current", "true");
                else link.removeAttribute("aria-current");
            }
        }
    };
    const observer = new IntersectionObserver(mark, { rootMargin: "-20% 0px -70% 0px" });
    for (const id of links.keys()) observer.observe(document.getElementById(id));
}
