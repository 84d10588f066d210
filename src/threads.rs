//! How many threads the CPU engine has.

use crate::error::{Error, Result, ensure_value};
use crate::lock::Kept;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::LazyLock;

/// Says how many where the caller does not.
const VARIABLE: &str = "LIXEL_THREADS";

/// Threads that a caller may ask for.
const MOST: usize = 1024;

/// The threads of the last call that asked for some: the next one mostly asks for as many.
static LAST: LazyLock<Kept<ThreadPool>> = LazyLock::new(Kept::default);

/// The number that is given, or the environment's.
fn asked_for(count: Option<usize>) -> Result<Option<usize>> {
    let variable = std::env::var(VARIABLE).ok().filter(|text| !text.is_empty());
    let (name, text) = match (count, variable) {
        (Some(count), _) => ("threads", count.to_string()),
        (None, Some(text)) => (VARIABLE, text),
        (None, None) => return Ok(None),
    };
    let found = text.parse().ok().filter(|count| (1..=MOST).contains(count));
    ensure_value!(
        found.is_some(),
        "{name} must be from 1 to {MOST}, got {text}"
    );
    Ok(found)
}

/// Does the work on so many threads. `None`: on as many as `LIXEL_THREADS` says; without it on those that the process
/// has for all, as many as `RAYON_NUM_THREADS` says or as there are cores.
pub fn on_threads<R: Send>(
    count: Option<usize>,
    work: impl FnOnce() -> Result<R> + Send,
) -> Result<R> {
    let Some(count) = asked_for(count)? else {
        return work();
    };
    let holds = |pool: &ThreadPool| pool.current_num_threads() == count;
    let build = |_| {
        let pool = ThreadPoolBuilder::new().num_threads(count).build();
        pool.map_err(|reason| Error::Device(format!("cannot start {count} threads: {reason}")))
    };
    let (pool, _) = LAST.get(holds, build)?;
    pool.install(work)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_done_on_as_many_threads_as_are_asked_for() {
        let threads = || Ok(rayon::current_num_threads());
        for count in [1, 3, 3, 2] {
            assert_eq!(on_threads(Some(count), threads).unwrap(), count);
        }
        assert_eq!(
            on_threads(None, threads).unwrap(),
            rayon::current_num_threads()
        );
        let refused = on_threads(Some(0), threads).unwrap_err().to_string();
        assert_eq!(refused, "threads must be from 1 to 1024, got 0");
    }
}
