//! The pages of a gallery: Markdown and HTML.

use std::fmt::Write as _;

use serde_json::Value;

use super::list::ListedImage;

/// An image with everything that the page reports of it.
pub struct Entry {
    /// Name, title and caption.
    pub image: ListedImage,
    /// The scene file's path, for display.
    pub scene_path: String,
    /// The scene file.
    pub scene_text: String,
    /// The image.
    pub picture: Picture,
    /// The same by the conventional tracer.
    pub beside: Option<Picture>,
}

/// An image file and what was counted and measured.
pub struct Picture {
    /// Name of the file.
    pub name: String,
    /// The statistics of the render.
    pub stats: Value,
}

impl Picture {
    /// Seconds from reading the scene to the written image.
    fn seconds(&self) -> f64 {
        self.stats.pointer("/seconds/total").and_then(Value::as_f64).unwrap_or(0.0)
    }
}

const TITLE: &str = "Gallery";
const INTRODUCTION: &str = "Every picture is rendered by `lightmesh gallery` from the scene file that is named with it. \
Seconds are wall-clock time from reading the scene to the written picture, and differ from machine to machine; mesh points \
and rays do not.";

/// What stands beside some images.
const BESIDE: &str = "conventional tracing";
const BELOW: &str = " Below it the same by conventional tracing.";

impl Entry {
    /// Name and value of what was counted and measured.
    fn facts(&self) -> Vec<(&'static str, String)> {
        let count = |pointer: &str| self.picture.stats.pointer(pointer).and_then(Value::as_u64).unwrap_or(0);
        let text = |pointer: &str| self.picture.stats.pointer(pointer).and_then(Value::as_str).unwrap_or("?");
        let seconds = self.picture.seconds();
        let mut facts = vec![
            (
                "size",
                format!(
                    "{}×{}, {} per pixel",
                    count("/resolution/0"),
                    count("/resolution/1"),
                    plural(count("/samples_per_pixel"), "ray")
                ),
            ),
            (
                "scene",
                format!("{} triangles, {}", grouped(count("/triangles")), plural(count("/lights"), "light")),
            ),
            (
                "seconds",
                format!(
                    "{seconds:.2} ({} on {} {})",
                    plural(count("/threads"), "thread"),
                    text("/backend/name"),
                    text("/backend/version")
                ),
            ),
        ];
        if let Some(beside) = &self.beside {
            facts.push(("seconds, conventionally", format!("{:.2}", beside.seconds())));
        }
        let share = |name: &str| {
            self.picture.stats.pointer(&format!("/accuracy/found/{name}")).and_then(Value::as_f64)
        };
        if let Some((error, confidence)) = share("error").zip(share("confidence")) {
            facts.push((
                "error of direct light",
                format!("{:.2} % ± {:.2}, measured", 100.0 * error, 100.0 * confidence),
            ));
        }
        for (name, kind) in [("direct mesh points", "direct"), ("indirect mesh points", "indirect")] {
            let total = count(&format!("/mesh_points/{kind}/total"));
            let evaluated = count(&format!("/mesh_points/{kind}/evaluated"));
            if total > 0 {
                facts.push((name, format!("{} of {} evaluated", grouped(evaluated), grouped(total))));
            } else if evaluated > 0 {
                facts.push(("points on surfaces", format!("{} evaluated", grouped(evaluated))));
            }
        }
        for (name, kind) in [
            ("camera rays", "camera"),
            ("reflected rays", "reflection"),
            ("occlusion rays", "shadow"),
            ("gathering rays", "indirect"),
        ] {
            let rays = count(&format!("/rays/{kind}"));
            if rays > 0 {
                facts.push((name, grouped(rays)));
            }
        }
        facts
    }

    /// The part of the scene file that says how it is rendered.
    fn settings(&self) -> String {
        let Ok(scene) = self.scene_text.parse::<toml::Table>() else { return self.scene_text.clone() };
        let keys = ["preset", "falloff", "falloff_constant", "render", "light_mesh"];
        let settings: toml::Table =
            scene.into_iter().filter(|(key, _)| keys.contains(&key.as_str())).collect();
        settings.to_string()
    }
}

/// A number with its digits in groups of three.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    groups.join(",")
}

fn plural(count: u64, noun: &str) -> String {
    format!("{} {noun}{}", grouped(count), if count == 1 { "" } else { "s" })
}

/// The page in Markdown; images lie beside it.
pub fn markdown(entries: &[Entry]) -> String {
    let mut page = format!("# {TITLE}\n\n{INTRODUCTION}\n");
    for entry in entries {
        let ListedImage { name, title, caption, .. } = &entry.image;
        // Writing to a string cannot fail.
        let _ = write!(page, "\n## {title}\n\n![{title}]({name}.png)\n\n");
        if let Some(Picture { name, .. }) = &entry.beside {
            let _ = write!(page, "![{title}: {BESIDE}]({name}.png)\n\n");
        }
        let below = if entry.beside.is_some() { BELOW } else { "" };
        let _ = write!(page, "{caption}{below}\n\n|  | `{}` |\n|---|---|\n", entry.scene_path);
        for (name, value) in entry.facts() {
            let _ = writeln!(page, "| {name} | {value} |");
        }
        let _ = write!(page, "\n```toml\n{}```\n", entry.settings());
    }
    page
}

/// The page in HTML; images lie beside it.
pub fn html(entries: &[Entry]) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{TITLE}</title>\n<style>{STYLE}</style>\n\
         <h1>{TITLE}</h1>\n<p>{}</p>\n",
        inline(INTRODUCTION)
    );
    for entry in entries {
        let ListedImage { name, title, caption, .. } = &entry.image;
        let (title, caption) = (inline(title), inline(caption));
        let show = |page: &mut String, picture: &Picture, title: &str| {
            let _ = writeln!(page, "<img alt=\"{title}\" src=\"{}.png\">", picture.name);
        };
        let _ = write!(page, "<section id=\"{name}\">\n<h2>{title}</h2>\n");
        show(&mut page, &entry.picture, &title);
        if let Some(beside) = &entry.beside {
            show(&mut page, beside, &format!("{title}: {BESIDE}"));
        }
        let below = if entry.beside.is_some() { BELOW } else { "" };
        let _ = write!(
            page,
            "<p>{caption}{below}</p>\n<table>\n<tr><th>file<td><code>{}</code>\n",
            escaped(&entry.scene_path)
        );
        for (name, value) in entry.facts() {
            let _ = writeln!(page, "<tr><th>{name}<td>{}", escaped(&value));
        }
        let _ = write!(page, "</table>\n<pre>{}</pre>\n</section>\n", escaped(&entry.settings()));
    }
    page + "</html>\n"
}

const STYLE: &str = ":root{color-scheme:light dark}\
body{font:16px/1.5 system-ui,sans-serif;max-width:80rem;margin:2rem auto;padding:0 1rem}\
img{display:block;max-width:100%;image-rendering:auto}\
section{margin-top:3rem}\
th{text-align:left;font-weight:normal;opacity:.7;padding-right:1rem}\
pre{padding:.7rem;background:#8882;overflow-x:auto}";

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Escaped text in which words between backquotes are code.
fn inline(text: &str) -> String {
    let mut html = String::new();
    for (index, part) in escaped(text).split('`').enumerate() {
        if index % 2 == 1 {
            let _ = write!(html, "<code>{part}</code>");
        } else {
            html.push_str(part);
        }
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_come_in_groups_of_three() {
        for (number, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")] {
            assert_eq!(grouped(number), text);
        }
    }

    /// What captions and scene files hold can't become markup.
    #[test]
    fn text_is_escaped() {
        assert_eq!(inline("a < b & `c > d`"), "a &lt; b &amp; <code>c &gt; d</code>");
    }
}
