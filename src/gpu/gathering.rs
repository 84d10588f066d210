//! Submissions that several frames share: what frames record side by side, each on its thread, goes to the
//! device together, and one wait serves all of them.

use super::device::Gpu;
use crate::error::{Error, Result};
use crate::lock::lock;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Frames that submit together.
struct Gathering {
    gpu: Arc<Gpu>,
    state: Mutex<State>,
    is_done: Condvar,
}

struct State {
    /// Frames that will submit again, or leave.
    members: usize,
    /// Of those that wait for the others.
    commands: Vec<wgpu::CommandBuffer>,
    /// What they want to read.
    reads: Vec<wgpu::Buffer>,
    submissions: usize,
    /// Of the last submission.
    outcome: Result<()>,
}

/// A frame's place among those that submit together; they do not wait for it once it is dropped.
pub struct Member(Arc<Gathering>);

impl Member {
    /// As many as `count`, that wait for each other.
    pub fn gather(gpu: &Arc<Gpu>, count: usize) -> Vec<Self> {
        let gathering = Arc::new(Gathering {
            gpu: gpu.clone(),
            state: Mutex::new(State {
                members: count,
                commands: Vec::new(),
                reads: Vec::new(),
                submissions: 0,
                outcome: Ok(()),
            }),
            is_done: Condvar::new(),
        });
        (0..count).map(|_| Self(gathering.clone())).collect()
    }

    /// Has the commands done and the buffers mapped, once every member has come or gone; waits for both.
    pub fn submit(
        &self,
        commands: wgpu::CommandBuffer,
        reads: impl Iterator<Item = wgpu::Buffer>,
    ) -> Result<()> {
        let Gathering { state, is_done, .. } = &*self.0;
        let mut state = lock(state);
        state.commands.push(commands);
        state.reads.extend(reads);
        let before = state.submissions;
        self.0.submit_if_all_came(&mut state);
        while state.submissions == before {
            state = is_done.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.outcome.clone()
    }
}

impl Drop for Member {
    fn drop(&mut self) {
        let mut state = lock(&self.0.state);
        state.members -= 1;
        self.0.submit_if_all_came(&mut state);
    }
}

impl Gathering {
    fn submit_if_all_came(&self, state: &mut MutexGuard<State>) {
        if state.commands.is_empty() || state.commands.len() < state.members {
            return;
        }
        let commands = std::mem::take(&mut state.commands);
        let reads = std::mem::take(&mut state.reads);
        state.outcome = self.submit(commands, &reads);
        state.submissions += 1;
        self.is_done.notify_all();
    }

    fn submit(&self, commands: Vec<wgpu::CommandBuffer>, reads: &[wgpu::Buffer]) -> Result<()> {
        let submission = self.gpu.queue.submit(commands);
        for buffer in reads {
            // A failure shows when the range is taken.
            buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        }
        let waited = self.gpu.device.poll(wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: None,
        });
        self.gpu.take_error()?;
        waited.map(drop).map_err(|error| {
            let name = &self.gpu.adapter.name;
            Error::Device(format!("waiting for the device {name} failed: {error}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::adapters::adapter;
    use super::super::recording::{Recording, Source};
    use super::*;

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn frames_wait_for_those_that_stay_and_for_no_other() {
        let gpu = Arc::new(Gpu::new(&adapter("").unwrap()).unwrap());
        // How often each submits; the last one leaves without a word.
        let rounds = [3, 1, 3, 0];
        let members = Member::gather(&gpu, rounds.len());
        let gathering = members[0].0.clone();
        std::thread::scope(|scope| {
            for (member, rounds) in members.into_iter().zip(rounds) {
                let gpu = &gpu;
                scope.spawn(move || {
                    let mut frame = Recording::new(gpu, member, true);
                    for _ in 0..rounds {
                        let buffer = frame.storage("buffer", 64).unwrap();
                        frame.clear(&buffer);
                        let read = frame.read::<u32>(Source::Taken(buffer), 16).unwrap();
                        let results = frame.submit().unwrap();
                        assert_eq!(results.take(&read).unwrap(), [0; 16]);
                    }
                });
            }
        });
        assert_eq!(lock(&gathering.state).submissions, 3);
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn a_failed_submission_is_an_error_to_all() {
        let gpu = Arc::new(Gpu::new(&adapter("").unwrap()).unwrap());
        let frames = Recording::together(&gpu, 3, true);
        std::thread::scope(|scope| {
            for (i, mut frame) in frames.into_iter().enumerate() {
                scope.spawn(move || {
                    let buffer = frame.storage("buffer", 64).unwrap();
                    frame.clear(&buffer);
                    if i == 1 {
                        buffer.discard();
                    }
                    assert!(frame.submit().is_err());
                });
            }
        });
    }
}
