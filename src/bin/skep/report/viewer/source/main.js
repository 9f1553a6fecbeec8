// The report of a run: reads the figures in the file and builds the sections of the page.

import { advice, overview } from "./overview.js";
import { capture } from "./capture.js";
import { charts } from "./charts.js";
import { cloud } from "./cloud.js";
import { cycles } from "./cycles.js";
import { figures } from "./figures.js";
import { gallery } from "./gallery.js";
import { options } from "./options.js";
import { markSections } from "./sections.js";

overview();
advice();
cloud();
gallery();
figures();
charts();
capture();
cycles();
options();
markSections();
document.documentElement.dataset.ready = "true";
