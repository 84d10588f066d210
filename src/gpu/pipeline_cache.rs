//! Compiled pipelines on disk, where the backend has such a cache: the next process does not compile them again.
//!
//! It is a help alone: what cannot be read or written is made anew, without a word.

use crate::lock::lock;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use wgpu::Features;

pub struct PipelineCache {
    pub cache: wgpu::PipelineCache,
    file: PathBuf,
    /// Whether a pipeline was compiled that the file may not have.
    is_new: AtomicBool,
    /// Threads of a process write one after the other, to a file of its own.
    writes: Mutex<()>,
}

impl PipelineCache {
    /// That of a device in a folder; `None` where its backend has none.
    pub fn open(device: &wgpu::Device, adapter: &wgpu::AdapterInfo, folder: &Path) -> Option<Self> {
        let key = wgpu::util::pipeline_cache_key(adapter)?;
        if !device.features().contains(Features::PIPELINE_CACHE) {
            return None;
        }
        let file = folder.join(key);
        let data = fs::read(&file).ok();
        // SAFETY: the file is written whole, by `save` alone. Another driver's, or one that is cut short, is told by its
        // header, and then the cache is empty.
        let cache = unsafe {
            device.create_pipeline_cache(&wgpu::PipelineCacheDescriptor {
                label: Some("pipelines"),
                data: data.as_deref(),
                fallback: true,
            })
        };
        Some(Self {
            cache,
            file,
            is_new: AtomicBool::new(false),
            writes: Mutex::default(),
        })
    }

    /// Remembers that there is more to save.
    pub fn grew(&self) {
        self.is_new.store(true, Ordering::Relaxed);
    }

    /// Writes the file, if a pipeline was compiled since the last time.
    pub fn save(&self) {
        if !self.is_new.swap(false, Ordering::Relaxed) {
            return;
        }
        let _one_at_a_time = lock(&self.writes);
        let Some(data) = self.cache.get_data() else {
            return;
        };
        // Who reads it meanwhile has the old one, whole.
        let part = self.file.with_extension(std::process::id().to_string());
        let folder = self.file.parent().map_or(Ok(()), fs::create_dir_all);
        let written = folder.and_then(|()| fs::write(&part, data));
        if written
            .and_then(|()| fs::rename(&part, &self.file))
            .is_err()
        {
            let _ = fs::remove_file(&part);
        }
    }
}

/// Where the user's programs keep what they can make again.
pub fn folder() -> Option<PathBuf> {
    Some(dirs::cache_dir()?.join("lixel"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::adapters::adapter;
    use crate::gpu::device::{Gpu, Variant};
    use crate::gpu::shaders::Shader;

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn a_file_is_written_when_it_grew_and_what_is_not_one_is_replaced() {
        let gpu = Gpu::variant(Variant::default());
        let adapter = adapter("").unwrap().get_info();
        let folder = std::env::temp_dir().join(format!("lixel-pipelines-{}", std::process::id()));
        let open = || PipelineCache::open(&gpu.device, &adapter, &folder);
        let Some(cache) = open() else {
            assert!(!gpu.device.features().contains(Features::PIPELINE_CACHE));
            return;
        };
        cache.save();
        assert!(!folder.exists());
        cache.grew();
        cache.save();
        let whole = fs::read(&cache.file).unwrap();
        assert!(!whole.is_empty());
        for other in [
            whole.clone(),
            whole[..20].to_vec(),
            b"no cache".repeat(99),
            vec![],
        ] {
            fs::write(&cache.file, other).unwrap();
            let cache = open().unwrap();
            let compile = || Ok(gpu.compile(Shader::new("packed_image"), "main", &[]));
            gpu.catch_errors(compile).unwrap();
            cache.grew();
            cache.save();
            assert_eq!(fs::read(&cache.file).unwrap().len(), whole.len());
        }
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
        // A folder that nobody can make.
        fs::write(&folder, "a file").unwrap();
        let cache = open().unwrap();
        cache.grew();
        cache.save();
        fs::remove_file(&folder).unwrap();
    }
}
