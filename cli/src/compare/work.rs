//! Minkowski maps of raw maps, made on the way to a comparison and kept for the next one.
//!
//! How one is made is left to [`mapping`](super::super::mapping).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail, ensure};
use longan::measures::Measure;
use longan_formats::{self as formats, Error};

use super::super::mapping::Mapping;
use super::super::options::{Running, is_same_file, shown};
use super::super::output::command;
use super::super::parallel::Jobs;
use super::super::progress::Progress;
use super::super::regridding;
use super::super::sink::Kind;
use super::provenance_reader::{MadeFrom, made_of};

/// Name of the file that says by which options the Minkowski maps of a folder are made.
const OPTIONS: &str = "options.txt";

/// Makes the Minkowski maps that the folder does not hold yet; what all of them say of themselves.
pub(super) fn minkowski_maps(
    folder: &Path,
    inputs: &[&Path],
    mapping: &Mapping,
    measures: Vec<Arc<dyn Measure>>,
    jobs: &Jobs,
    running: &Running,
) -> anyhow::Result<Vec<MadeFrom>> {
    let mapper = mapping.mapper(measures, jobs.memory(), running, true)?;
    let outputs = outputs(folder, inputs)?;
    for path in inputs {
        if MadeFrom::of(path, mapping.input().hdu).is_ok_and(|said| said.is_some()) {
            bail!("{}: this is a Minkowski map of longan already; compare it without --work", shown(path));
        }
        let steps = mapping.input().open(path)?.steps();
        ensure!(
            steps == 1,
            "{}: there are maps for {steps} times, and a comparison takes one; choose it with --select",
            shown(path)
        );
    }
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot make this folder", shown(folder)))?;
    record(folder, mapping, &outputs)?;
    let tasks = tasks(inputs, &outputs, mapping.mask())?;
    let all: Vec<PathBuf> = inputs.iter().map(|input| input.to_path_buf()).collect();
    let progress = Progress::of_parts(tasks.len(), running.quiet || tasks.is_empty());
    let told = regridding::Said::default();
    let made = jobs.run(&tasks, |(input, output)| {
        let part = progress.part();
        let made = mapper.map(input, output, true, &command(&all, input), |share| part.set(share))?;
        drop(part);
        told.say_note(running, input, made.note);
        made.warnings.into_iter().for_each(|warning| running.warn(warning));
        anyhow::Ok(())
    });
    drop(progress);
    // The others are done, and are not done again when this one can be.
    made.into_iter().collect::<anyhow::Result<()>>()?;
    let said = |output: &PathBuf| {
        MadeFrom::of(output, None)?
            .with_context(|| format!("{}: this is no Minkowski map of longan; remove it", shown(output)))
    };
    outputs.iter().map(said).collect()
}

/// Where the Minkowski map of each input belongs.
fn outputs(folder: &Path, inputs: &[&Path]) -> anyhow::Result<Vec<PathBuf>> {
    let mut names: BTreeMap<PathBuf, &Path> = BTreeMap::new();
    let mut outputs = Vec::new();
    for input in inputs {
        ensure!(input.file_name().is_some(), "{}: this is not a file; name files", shown(input));
        let output = folder.join(Kind::name_for(input));
        if let Some(other) = names.insert(output.clone(), input).filter(|other| !is_same_file(other, input)) {
            bail!(
                "the Minkowski maps of {} and {} would both be {}; give them different names",
                shown(other),
                shown(input),
                shown(&output)
            );
        }
        if let (Ok(from), Ok(to)) = (input.canonicalize(), output.canonicalize()) {
            ensure!(
                from != to,
                "{}: its Minkowski map would replace it; choose another folder for --work",
                shown(input)
            );
        }
        outputs.push(output);
    }
    Ok(outputs)
}

/// Notes the options in the folder, unless they are there already.
fn record(folder: &Path, mapping: &Mapping, outputs: &[PathBuf]) -> anyhow::Result<()> {
    let path = folder.join(OPTIONS);
    let options = format!(
        "The Minkowski maps in this folder are made by longan {} with these options.\n{:#?}\n",
        env!("CARGO_PKG_VERSION"),
        mapping.plain()
    );
    match fs::read(&path) {
        Ok(old) => ensure!(
            old == options.as_bytes(),
            "{}: the Minkowski maps there are made by other options, which {OPTIONS} lists; choose another folder for \
             --work, or remove this one",
            shown(folder)
        ),
        Err(_) => {
            if let Some(output) = outputs.iter().find(|output| output.exists()) {
                bail!(
                    "{}: nothing in its folder says by which options it is made; choose another folder for --work",
                    shown(output)
                );
            }
            formats::save(&path, false, |path| fs::write(path, &options).map_err(Error::io("write it")))?;
        }
    }
    Ok(())
}

/// The Minkowski maps that are still to be made: those that do not exist, or whose input or mask has changed since.
fn tasks<'a>(
    inputs: &[&'a Path],
    outputs: &'a [PathBuf],
    mask: Option<&Path>,
) -> anyhow::Result<Vec<(&'a Path, &'a Path)>> {
    let mut tasks: Vec<(&Path, &Path)> = Vec::new();
    for (input, output) in inputs.iter().zip(outputs) {
        if output.exists() {
            let from = made_of(output)?.unwrap_or_default();
            ensure!(
                is_same_file(Path::new(&from), input),
                "{}: it is made of {from}, not of {}; choose another folder for --work",
                shown(output),
                shown(input)
            );
            let changed = |path: &Path| path.metadata().and_then(|metadata| metadata.modified()).ok();
            let since = |path: &Path| {
                changed(path).is_none_or(|changed_at| changed(output).is_none_or(|made| changed_at > made))
            };
            if !std::iter::once(*input).chain(mask).any(since) {
                continue;
            }
        }
        if !tasks.iter().any(|(_, other)| other == output) {
            tasks.push((*input, output));
        }
    }
    Ok(tasks)
}
