//! Many maps at a time: threads that take one input after the other, and the memory that they share.
//!
//! These threads read, write and wait. What is computed in parallel goes to one pool of `--threads` for all.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use anyhow::ensure;
use clap::Args;
use sysinfo::{MemoryRefreshKind, System};

use super::progress::give_back;

/// How many maps are computed at a time.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Running")]
pub(crate) struct Jobs {
    /// Number of maps that are worked on at a time, up to 1024, so that one is read or written while others are
    /// computed; fewer where memory is short. All are computed by the same threads, and results do not depend on it
    /// [default: the number of threads].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Memory that this run may take, by an estimate from Nside, measures and windows, such as 4G or 500M (powers of
    /// 1000; 4GiB, 500MiB of 1024); a map that needs more is refused [default: half of what is free, where one map runs
    /// alone if it needs more].
    #[arg(long, value_name = "SIZE", value_parser = size)]
    memory: Option<u64>,
}

impl Jobs {
    /// The memory that maps may take together.
    pub(crate) fn memory(&self) -> Memory {
        let total = self.memory.unwrap_or_else(|| free_memory() / 2).saturating_sub(PROGRAM);
        Memory { asked: self.memory, total, free: Mutex::new(total), given_back: Condvar::new() }
    }

    /// Does all of some tasks, several at a time, and begins them in their order; the results are in that order too.
    pub(crate) fn run<T: Sync, R: Send>(&self, tasks: &[T], each: impl Fn(&T) -> R + Sync) -> Vec<R> {
        let threads = self.jobs.map_or_else(rayon::current_num_threads, usize::from).clamp(1, tasks.len().max(1));
        if threads > 1 {
            return_at_once();
        }
        let next = AtomicUsize::new(0);
        let work = || {
            let mut done = Vec::new();
            loop {
                let i = next.fetch_add(1, Ordering::Relaxed);
                let Some(task) = tasks.get(i) else { return done };
                done.push((i, each(task)));
            }
        };
        let mut done: Vec<(usize, R)> = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            let join = |thread: std::thread::ScopedJoinHandle<'_, _>| match thread.join() {
                Ok(done) => done,
                Err(panic) => std::panic::resume_unwind(panic),
            };
            threads.into_iter().flat_map(join).collect()
        });
        done.sort_by_key(|(i, _)| *i);
        done.into_iter().map(|(_, result)| result).collect()
    }
}

/// Memory that the program takes without any map: its libraries, and what the allocators of several threads keep.
const PROGRAM: u64 = 32 << 20;

/// Arrays of so many bytes are mapped by themselves: maps, and not what is made and dropped all the time while windows
/// are summed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const MAPPED: libc::c_int = 1 << 24;

/// Has large arrays returned to the system when they are freed. GNU's allocator would come to keep them, a heap for each
/// thread, so that maps took more than the sum of theirs.
fn return_at_once() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the function only sets from which size on arrays are mapped by themselves.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED);
    }
}

/// Memory that is free on this machine, or in the container that this is.
fn free_memory() -> u64 {
    let mut system = System::new();
    system.refresh_memory_specifics(MemoryRefreshKind::nothing().with_ram());
    let of_container = system.cgroup_limits().map_or(u64::MAX, |limits| limits.free_memory);
    system.available_memory().min(of_container)
}

/// Memory that maps take in turn.
pub(crate) struct Memory {
    /// All that the program may take, where that was asked for.
    asked: Option<u64>,
    /// All that maps may take.
    total: u64,
    free: Mutex<u64>,
    given_back: Condvar,
}

/// Memory that is taken until this is dropped.
pub(crate) struct Taken<'a> {
    memory: &'a Memory,
    bytes: u64,
}

impl Memory {
    /// Waits until there is so much, or all of it where it is not known how much is needed.
    pub(crate) fn take(&self, bytes: Option<usize>) -> anyhow::Result<Taken<'_>> {
        let bytes = bytes.map_or(self.total, |bytes| bytes as u64);
        if let Some(asked) = self.asked {
            ensure!(
                bytes <= self.total,
                "this needs about {} of memory, and --memory allows {}; allow more",
                shown(bytes.saturating_add(PROGRAM)),
                shown(asked)
            );
        }
        let bytes = bytes.min(self.total);
        let mut free = self.free();
        while *free < bytes {
            free = self.given_back.wait(free).unwrap_or_else(PoisonError::into_inner);
        }
        *free -= bytes;
        Ok(Taken { memory: self, bytes })
    }

    fn free(&self) -> MutexGuard<'_, u64> {
        self.free.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        give_back();
        *self.memory.free() += self.bytes;
        self.memory.given_back.notify_all();
    }
}

/// A size in bytes.
fn size(text: &str) -> Result<u64, String> {
    let wrong = || "not a size such as 4G, 500M or 2GiB".to_owned();
    let capitals = text.to_ascii_uppercase();
    let rest = capitals.strip_suffix('B').unwrap_or(&capitals);
    let (rest, kilo) = rest.strip_suffix('I').map_or((rest, 1000.0), |rest| (rest, 1024.0));
    let unit = (1..).zip("KMGT".chars()).find_map(|(power, unit)| Some((rest.strip_suffix(unit)?, power)));
    let (number, power) = unit.ok_or_else(wrong)?;
    let number: f64 = number.trim().parse().map_err(|_| wrong())?;
    if number.is_finite() && number > 0.0 { Ok((number * f64::powi(kilo, power)).ceil() as u64) } else { Err(wrong()) }
}

/// A size in words.
fn shown(bytes: u64) -> String {
    match bytes as f64 {
        bytes if bytes < 1e9 => format!("{:.0} MB", (bytes / 1e6).ceil()),
        bytes => format!("{:.1} GB", (bytes / 1e8).ceil() / 10.0),
    }
}
