//! The examples at the end of every `--help` and man page.

use clap::Command;
use clap::builder::styling::Style;

/// A command line, and what it does.
pub struct Example {
    /// The whole line; words hold no blanks and nothing that a shell would change but `*`.
    pub line: &'static str,
    /// What it is for, in half a sentence.
    pub what: &'static str,
}

const fn example(line: &'static str, what: &'static str) -> Example {
    Example { line, what }
}

/// The examples of each command, by its path below the program's name; the program's own have none.
const EXAMPLES: &[(&[&str], &[Example])] = &[
    (
        &[],
        &[
            example("lightmesh generate forest -o forest", "a scene to begin with"),
            example("lightmesh render forest/forest.toml -o forest.png", "its picture"),
            example("lightmesh --version --verbose", "what this build is, and which backends it finds"),
        ],
    ),
    (
        &["render"],
        &[
            example("lightmesh render scene.toml -o picture.png", "a scene file, with its own settings"),
            example(
                "lightmesh render model.obj -o picture.exr -o picture.png",
                "a bare model, with camera and lights chosen for it",
            ),
            example(
                "lightmesh render scene.toml -o picture.exr --float --spp 64 --max-error 1%",
                "a final picture",
            ),
            example(
                "lightmesh render scene.toml -o quick.png --resolution 160x120 --spp 1 --max-error 0",
                "a quick look",
            ),
            example(
                "lightmesh render scene.toml -o soft.png --shadows soft --memory-limit 2G",
                "soft shadows, as good as the memory allows",
            ),
            example(
                "lightmesh render scene.toml -o truth.exr --integrator conventional",
                "what the light mesh is to be compared with",
            ),
            example(
                "lightmesh render scene.toml --light-mesh field.lmesh --update -o picture.png",
                "by a light mesh that is kept from render to render",
            ),
            example("lightmesh render scene.toml --camera all -o {camera}.png", "a picture for each camera"),
            example(
                "lightmesh render scene.toml -o layers.exr --aov direct,error",
                "with layers: direct light, and its estimated error",
            ),
            example("lightmesh render scene.toml --tile 1/2 -o t1.exr", "the first half of a picture"),
            example(
                "lightmesh render scene.toml --tile 2/2 -o t2.exr",
                "the second, on another machine perhaps",
            ),
        ],
    ),
    (
        &["bake"],
        &[
            example("lightmesh bake scene.toml -o field.lmesh", "what the scene's cameras see"),
            example("lightmesh bake scene.toml -o box.lmesh --box 0,0,0 1,1,1", "all mesh points in a box"),
        ],
    ),
    (&["merge"], &[example("lightmesh merge t1.exr t2.exr -o whole.exr", "two halves to the whole")]),
    (
        &["probe"],
        &[
            example(
                "lightmesh probe scene.toml --points desks.csv -o desks_lux.csv",
                "lux at points of a file",
            ),
            example(
                "lightmesh probe scene.toml --line 0,0.8,0 1,0.8,0 --samples 11 --normal 0,1,0 -o walk.csv",
                "along a line",
            ),
            example(
                "lightmesh probe scene.toml --plane 0,0.1,1 1,0,0 0,0,-1 --resolution 20x12 -o lux.png",
                "on a plane, in false colours",
            ),
            example(
                "lightmesh probe scene.toml --grid 4x2x4 -o probes.json",
                "spherical harmonics for a game engine",
            ),
        ],
    ),
    (
        &["export"],
        &[
            example(
                "lightmesh export field.lmesh -o field.vtu -o field.ply",
                "baked mesh points, for ParaView and others",
            ),
            example("lightmesh export field.lmesh -o field.vti", "the same as a regular grid, for volumes"),
        ],
    ),
    (
        &["info"],
        &[
            example("lightmesh info scene.toml", "what there is"),
            example("lightmesh info model.obj --json", "the same for a program"),
        ],
    ),
    (&["init"], &[example("lightmesh init model.obj -o new.toml", "a scene file to edit")]),
    (
        &["generate"],
        &[example(
            "lightmesh generate forest -o forest",
            "forest.obj, forest.mtl and forest.toml in a folder",
        )],
    ),
    (
        &["generate", "forest"],
        &[example("lightmesh generate forest --triangles 3000 --lights 20 -o small", "a small forest")],
    ),
    (
        &["generate", "interior"],
        &[example("lightmesh generate interior --bays 4 --lamps 20 -o hall", "a hall with 80 lamps")],
    ),
    (
        &["generate", "still-life"],
        &[example("lightmesh generate still-life -o still-life", "the still life")],
    ),
    (
        &["bench"],
        &[
            example("lightmesh bench headline --quick", "whether everything runs"),
            example(
                "lightmesh bench scenes scene.toml --json scenes.json --html scenes.html",
                "a scene by light mesh and by the conventional tracer",
            ),
        ],
    ),
    (
        &["crosscheck"],
        &[
            example("lightmesh crosscheck scene.toml --rays 10000", "all backends against each other"),
            example("lightmesh crosscheck model.obj --rays 10000 --json report.json", "with a report"),
        ],
    ),
    (
        &["gallery"],
        &[example(
            "lightmesh gallery --list gallery.toml --out pages",
            "the images of a list, and pages about them",
        )],
    ),
    (
        &["compare"],
        &[
            example("lightmesh compare a.png b.png", "all numbers"),
            example(
                "lightmesh compare a.png b.png --error-image error.png --fail-above rmse=0.5",
                "a picture of the errors, and exit code 1 where they are large",
            ),
        ],
    ),
    (
        &["completions"],
        &[example(
            "lightmesh completions bash > lightmesh.bash",
            "for a folder such as ~/.local/share/bash-completion/completions",
        )],
    ),
    (
        &["man"],
        &[
            example("lightmesh man man1", "all pages, in a folder"),
            example("lightmesh man", "the program's own page, on stdout"),
        ],
    ),
];

/// The examples of a command, by its path below the program's name.
pub fn examples_of(path: &[&str]) -> &'static [Example] {
    EXAMPLES.iter().find(|(known, _)| *known == path).map_or(&[], |(_, examples)| examples)
}

/// The command with examples in the help of all its subcommands.
pub fn with_examples(command: Command) -> Command {
    add(command, &mut Vec::new())
}

fn add(command: Command, path: &mut Vec<String>) -> Command {
    let names: Vec<String> = command.get_subcommands().map(|sub| sub.get_name().to_owned()).collect();
    let known: Vec<&str> = path.iter().map(String::as_str).collect();
    let examples = examples_of(&known);
    let mut command = if examples.is_empty() { command } else { command.after_help(text(examples)) };
    for name in names {
        path.push(name.clone());
        command = command.mut_subcommand(name, |sub| add(sub, path));
        path.pop();
    }
    command
}

fn text(examples: &[Example]) -> String {
    // As clap shows headings.
    let style = Style::new().bold().underline();
    let mut text = format!("{style}Examples:{style:#}");
    for Example { line, what } in examples {
        text += &format!("\n  {line}\n          {what}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Calls `each` for a command and all below it.
    fn walk(command: &Command, path: &mut Vec<String>, each: &mut impl FnMut(&Command, &[String])) {
        each(command, path);
        for sub in command.get_subcommands() {
            path.push(sub.get_name().to_owned());
            walk(sub, path, each);
            path.pop();
        }
    }

    /// Whoever reads the help of a command finds an example there that is one of this command, and that it accepts.
    #[test]
    fn every_command_has_examples_that_it_accepts() {
        let command = super::super::command();
        let mut count = 0;
        walk(&command, &mut Vec::new(), &mut |sub, path| {
            let path: Vec<&str> = path.iter().map(String::as_str).collect();
            let examples = examples_of(&path);
            assert!(!examples.is_empty(), "{path:?} has no example");
            let help = sub.get_after_help().map(ToString::to_string).unwrap_or_default();
            for Example { line, .. } in examples {
                assert!(help.contains(line), "{path:?}: {help}");
                // A shell takes what follows for itself.
                let words: Vec<&str> = line.split_whitespace().take_while(|word| *word != ">").collect();
                assert!(words[1..].starts_with(&path), "{line} is not of {path:?}");
                match command.clone().try_get_matches_from(&words) {
                    Ok(_) => {}
                    Err(error) => assert!(!error.use_stderr(), "{line}: {error}"),
                }
                count += 1;
            }
        });
        assert_eq!(count, EXAMPLES.iter().map(|(_, examples)| examples.len()).sum::<usize>());
    }
}
