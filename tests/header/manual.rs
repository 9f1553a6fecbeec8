//! `include/skep.h` from what cbindgen writes.
//!
//! cbindgen writes all constants, then all types, then all functions. Here they are put into sections, one
//! for each file of the interface, with a title and a list of the sections at the top. Opaque types are
//! declared before all sections: C wants them before they are named. The first paragraph of their
//! descriptions stays with them; the others open the section of the file.

use super::{config, options, root};
use std::fmt::Write;

/// A section of the manual: the file it is made from, and its title.
const SECTIONS: [(&str, &str); 15] = [
    ("status", "Statuses, errors and versions"),
    ("options", "Options"),
    ("camera", "Cameras"),
    ("image", "Images"),
    ("scene", "Scenes"),
    ("progress", "Progress and cancellation"),
    ("result", "Whole runs and their results"),
    ("borrow", "Maps inside a result"),
    ("cloud", "Point clouds"),
    ("fusion", "Fusion"),
    ("stepper", "Stepwise runs"),
    ("estimate", "Estimates of single views"),
    ("kernels", "Kernels"),
    ("files", "Files"),
    ("job", "Runs in a folder"),
];
const OBJECTS: &str = "Objects";
/// Files whose contents continue the section of the file before the underscore.
const CONTINUED: [(&str, &str); 3] =
    [("result_maps", "result"), ("scene_queries", "scene"), ("stepper_stages", "stepper")];
const WIDTH: usize = 110;
const END_OF_INCLUDES: &str = "#include <stdint.h>\n";
const END_OF_ITEMS: &str = "#ifdef __cplusplus\n}";

/// A declaration with its description.
pub struct Item {
    /// The lines of the description without their marks.
    comment: Vec<String>,
    code: String,
}

impl Item {
    fn parse(text: &str) -> Item {
        let (comment, code) = text.split_once("\n */\n").expect("everything public is described");
        let line = |line: &str| {
            let text = line.strip_prefix(" *").expect("lines of a description are marked");
            text.strip_prefix(' ').unwrap_or(text).to_string()
        };
        Item { comment: comment.lines().map(line).collect(), code: code.trim_end().to_string() }
    }

    pub fn is_function(&self) -> bool {
        self.code.ends_with(");") && !self.code.starts_with("typedef")
    }

    fn is_opaque(&self) -> bool {
        self.code.starts_with("typedef struct") && !self.code.contains('{')
    }

    pub fn name(&self) -> &str {
        let is_mark = |character: char| !(character.is_alphanumeric() || character == '_');
        let mut words = self.code.split(is_mark).filter(|word| word.to_lowercase().starts_with("skep_"));
        // Most functions return a status, whose name comes before theirs.
        let own = words.find(|word| *word != "skep_status" || !self.is_function());
        own.expect("everything public has the prefix")
    }

    /// The names of a function's parameters.
    pub fn parameters(&self) -> Vec<&str> {
        let list = self.code.split_once('(').map_or("", |(_, list)| list.trim_end_matches(");"));
        let name = |parameter: &'_ str| parameter.rfind([' ', '*']).map(|end| end + 1);
        let named = list.split(',').filter(|parameter| parameter.trim() != "void");
        named.filter_map(|parameter| Some(&parameter[name(parameter)?..])).collect()
    }

    /// The names of the parameters that the description explains.
    pub fn described(&self) -> Vec<&str> {
        let explained = self.comment.iter().filter_map(|line| line.strip_prefix("@param "));
        explained.filter_map(|text| text.split_whitespace().next()).collect()
    }

    fn write(&self, comment: &[String], out: &mut String) {
        out.push_str("/**\n");
        write_lines(comment, out);
        write!(out, " */\n{}\n\n", self.code).unwrap();
    }
}

fn write_lines(lines: &[String], out: &mut String) {
    for line in lines {
        writeln!(out, "{}", format!(" * {line}").trim_end()).unwrap();
    }
}

pub fn text_of(builder: cbindgen::Builder) -> String {
    let mut text = Vec::new();
    builder.generate().expect("the source can be understood").write(&mut text);
    String::from_utf8(text).expect("a header is text")
}

fn from_cbindgen() -> String {
    let files = SECTIONS.map(|(file, _)| file).into_iter().chain(CONTINUED.map(|(file, _)| file));
    let paths = files.map(|file| root().join(format!("src/capi/{file}.rs")));
    text_of(paths.fold(cbindgen::Builder::new().with_config(config()), cbindgen::Builder::with_src))
}

/// The head, up to the first declaration, and the declarations.
fn parts() -> (String, Vec<Item>) {
    let text = from_cbindgen();
    let (head, rest) = text.split_once(END_OF_INCLUDES).expect("the includes are there");
    let (body, _) = rest.rsplit_once(END_OF_ITEMS).expect("the declarations end");
    let body = body.replace("#ifdef __cplusplus\nextern \"C\" {\n#endif // __cplusplus\n", "");
    (head.to_string(), body.split("\n/**\n").skip(1).map(Item::parse).collect())
}

pub fn items() -> Vec<Item> {
    parts().1
}

/// The section that an item belongs to: that of the file where it is defined.
fn section_of(item: &Item, sources: &[(&'static str, String)]) -> &'static str {
    let name = item.name();
    let definitions = [
        format!(" fn {name}("),
        format!("pub const {name}: "),
        format!("pub struct {name} "),
        format!("pub type {name} ="),
    ];
    let defines =
        |source: &&(&str, String)| definitions.iter().any(|definition| source.1.contains(definition));
    let file = sources.iter().find(defines).unwrap_or_else(|| panic!("{name} is not defined in any file")).0;
    CONTINUED.iter().find(|(continued, _)| *continued == file).map_or(file, |(_, section)| section)
}

fn title(text: &str) -> String {
    let start = format!("/* ---- {text} ");
    format!("{start}{} */\n\n", "-".repeat(WIDTH - 3 - start.len()))
}

/// The whole header.
pub fn header() -> String {
    let (head, items) = parts();
    let files = SECTIONS.map(|(file, _)| file).into_iter().chain(CONTINUED.map(|(file, _)| file));
    let read = |file: &'static str| {
        let path = root().join(format!("src/capi/{file}.rs"));
        (file, std::fs::read_to_string(path).expect("it is one of the files"))
    };
    let sources: Vec<_> = files.map(read).collect();

    let (head, guard) = head.split_once("\n */\n").expect("cbindgen.toml has a head");
    let mut out = format!("{head}\n *\n * Sections:\n");
    let titles = std::iter::once(OBJECTS).chain(SECTIONS.map(|(_, title)| title));
    titles.clone().for_each(|title| writeln!(out, " *   {title}").unwrap());
    write!(out, " */\n{guard}{END_OF_INCLUDES}\n#ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n").unwrap();

    out.push_str(&title(OBJECTS));
    for item in items.iter().filter(|item| item.is_opaque()) {
        item.write(first_paragraph(&item.comment).0, &mut out);
    }
    for (file, text) in SECTIONS {
        out.push_str(&title(text));
        let own: Vec<&Item> = items.iter().filter(|item| section_of(item, &sources) == file).collect();
        for item in own.iter().filter(|item| item.is_opaque()) {
            let introduction = first_paragraph(&item.comment).1;
            if !introduction.is_empty() {
                out.push_str("/*\n");
                write_lines(introduction, &mut out);
                out.push_str(" */\n\n");
            }
        }
        if file == "options" {
            out.push_str(&options::in_c());
        }
        own.iter().filter(|item| !item.is_opaque()).for_each(|item| item.write(&item.comment, &mut out));
    }
    out + "#ifdef __cplusplus\n} /* extern \"C\" */\n#endif\n\n#endif /* SKEP_H */\n"
}

/// The first paragraph and the others.
fn first_paragraph(lines: &[String]) -> (&[String], &[String]) {
    let end = lines.iter().position(String::is_empty).unwrap_or(lines.len());
    (&lines[..end], lines.get(end + 1..).unwrap_or_default())
}
