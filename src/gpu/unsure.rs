//! Tests that float32 leaves open, `shaders/lib/unsure.wgsl`: noted on the device, decided on the CPU in float64.

use super::pool::PooledBuffer;
use super::recording::{Read, ReadResults, Recording, Source};
use super::scene_tables::Room;
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::light::Light;
use crate::occlusion::ReceiverRay;
use crate::scene::Scene;
use crate::stats::{Fact, Facts};
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// The timer's key.
pub const LABEL: &str = "float64 (CPU)";

/// Of pixel, triangle of the receiver and caster.
const WORDS: u64 = 3;

/// Stands for the light's cone.
const NO_CASTER: u32 = u32::MAX;

/// The list on the device, and how many tests it has room for.
pub struct UnsureTests {
    pub list: PooledBuffer,
    room: u64,
}

/// The list as it comes back.
pub struct UnsureRead {
    words: Read<u32>,
    room: u64,
}

impl UnsureTests {
    pub fn new(frame: &mut Recording, room: &Room) -> Result<Self> {
        let room = room.unsure_tests.load(Ordering::Relaxed);
        let list = frame.storage("open tests", 4 * (1 + WORDS * room))?;
        frame.clear(&list);
        Ok(Self { list, room })
    }

    pub fn read(self, frame: &mut Recording) -> Result<UnsureRead> {
        let Self { list, room } = self;
        let count = (1 + WORDS * room) as usize;
        let words = frame.read(Source::Taken(list), count)?;
        Ok(UnsureRead { words, room })
    }
}

impl UnsureRead {
    /// Puts pixels that a test finds in shadow into the image, and tells how many tests there were and how many
    /// found that. `None` where the list was too short: then there is room for the next try.
    pub fn decide(
        &self,
        results: &ReadResults,
        room: &Room,
        (scene, camera, light): (&Scene, &Camera, &Light),
        visibility: &mut [f32],
    ) -> Result<Option<Facts>> {
        results.with(&self.words, |words| {
            self.decide_in(words, room, (scene, camera, light), visibility)
        })?
    }

    fn decide_in(
        &self,
        words: &[u32],
        room: &Room,
        (scene, camera, light): (&Scene, &Camera, &Light),
        visibility: &mut [f32],
    ) -> Result<Option<Facts>> {
        let count = words[0];
        if u64::from(count) > self.room {
            let wanted = u64::from(count).next_power_of_two();
            if WORDS * wanted > u64::from(u32::MAX) / 4 {
                return Err(Error::Device(format!(
                    "float32 leaves {count} tests open, more than a list of the device holds"
                )));
            }
            room.unsure_tests.fetch_max(wanted, Ordering::Relaxed);
            return Ok(None);
        }
        if count == 0 {
            return Ok(Some(Vec::new()));
        }
        let tests = &words[1..].as_chunks::<{ WORDS as usize }>().0[..count as usize];
        let find = |&[pixel, triangle, caster]: &[u32; 3]| {
            let is_lit = visibility[pixel as usize] > 0.0;
            let is_in_shadow = || {
                let ray = ReceiverRay::new(scene, camera, light, pixel, triangle);
                match caster {
                    NO_CASTER => !ray.is_facing(light),
                    _ => ray.is_shadowed_by(caster) && !ray.is_hidden_by(caster),
                }
            };
            (is_lit && is_in_shadow()).then_some(pixel)
        };
        let found = tests.par_iter().with_min_len(64).filter_map(find);
        let found: Vec<_> = found.collect();
        for &pixel in &found {
            visibility[pixel as usize] = 0.0;
        }
        Ok(Some(vec![
            Fact::sum("tests", count),
            Fact::sum("found_in_shadow", found.len() as u32),
        ]))
    }
}
