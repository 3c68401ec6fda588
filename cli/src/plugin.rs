//! Plugins: the options that load them, and `longan plugin`, which starts a new one.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::{Args, Subcommand};
use longan::measures::plugin::{self, PATH_VARIABLE, Plugin};
use longan::measures::{Catalogue, find};

use super::options::{print, shown};

/// Where measures are loaded from.
#[derive(Args, Clone, Debug, Default, PartialEq)]
pub(crate) struct Plugins {
    /// Library with measures of your own, beside those in the folders of LONGAN_PLUGIN_PATH; may be repeated. It is
    /// code that runs with your rights.
    #[arg(long, value_name = "FILE")]
    pub(crate) plugin: Vec<PathBuf>,
}

impl Plugins {
    /// The built-in measures and those of the plugins, each file loaded once.
    pub(crate) fn catalogue(&self) -> anyhow::Result<Catalogue> {
        let folders = std::env::var_os(PATH_VARIABLE).unwrap_or_default();
        let mut seen = Vec::new();
        let mut plugins = Vec::new();
        for path in self.plugin.iter().cloned().chain(plugin::in_folders(&folders)?) {
            let same = path.canonicalize().ok();
            if same.is_some() && seen.contains(&same) {
                continue;
            }
            seen.push(same);
            plugins.push(Plugin::load(&path)?);
        }
        Ok(Catalogue::new(plugins)?)
    }
}

/// Measures of your own, loaded from a library.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    New(New),
}

/// Writes a ready crate in Rust with a measure and its tests, in a new folder.
#[derive(Args, Debug)]
struct New {
    /// Name of the measure and the folder: a lower-case letter, then lower-case letters, digits and hyphens.
    #[arg(value_name = "NAME")]
    name: String,
    /// Folder of longan's sources, which the crate is built with [default: those that this program was built from].
    #[arg(long, value_name = "FOLDER")]
    sources: Option<PathBuf>,
}

/// The files of a new crate. NAME and SOURCES stand for what is asked for.
const FILES: [(&str, &str); 3] = [
    ("Cargo.toml", include_str!("plugin/Cargo.toml.in")),
    ("src/lib.rs", include_str!("plugin/lib.rs.in")),
    (".gitignore", "/target\n"),
];

/// Where this program's sources lay when it was built.
const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    match &arguments.command {
        Command::New(new) => new.run(),
    }
}

impl New {
    fn run(&self) -> anyhow::Result<()> {
        let name = &self.name;
        ensure!(
            plugin::is_name(name),
            "'{}' cannot be a measure's name; take a lower-case letter and then lower-case letters, digits and hyphens",
            name.replace(char::is_control, "\u{fffd}")
        );
        ensure!(find(name).is_err(), "'{name}' is a built-in measure; choose another name");
        let sources = self.sources.as_deref().unwrap_or(Path::new(SOURCES));
        let own = sources.join("measures/plugin");
        ensure!(
            own.join("Cargo.toml").is_file(),
            "{}: longan's sources are not there; name their folder with --sources",
            shown(sources)
        );
        let own = own.canonicalize().with_context(|| shown(&own))?;
        let own =
            own.to_str().with_context(|| format!("{}: this path is not UTF-8, as Cargo wants it", shown(&own)))?;
        // A JSON string is a TOML one.
        let own = serde_json::to_string(own)?;

        let folder = Path::new(name);
        let place = || format!("{name}: cannot write this folder");
        ensure!(fs::symlink_metadata(folder).is_err(), "{name}: this exists; remove it or choose another name");
        fs::create_dir(folder).with_context(place)?;
        let written = fs::create_dir(folder.join("src")).and_then(|()| {
            FILES.iter().try_for_each(|(file, text)| {
                fs::write(folder.join(file), text.replace("@NAME@", name).replace("@SOURCES@", &own))
            })
        });
        if written.is_err() {
            // Half a crate is of no use.
            let _ = fs::remove_dir_all(folder);
        }
        written.with_context(place)?;
        let library = plugin::library_of(&format!("{}_measure", name.replace('-', "_")));
        print(&format!(
            "{name}: a crate with the measure '{name}' in src/lib.rs; to test, build and use it:\n\
             \x20 cd {name}\n\
             \x20 cargo test\n\
             \x20 cargo build --release\n\
             \x20 longan map sky.fits -o out.fits --plugin target/release/{library} --measure {name}\n"
        ))
    }
}
