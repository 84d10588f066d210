//! Every entry point of every shader in the languages of the backends: what their drivers get to compile.

use super::shaders::tests::{MODULES, validated};
use naga::back::{PipelineConstants, hlsl, msl, pipeline_constants::process_overrides, spv};
use naga::valid::ModuleInfo;
use naga::{Module, ScalarKind, ShaderStage, TypeInner};
use rayon::prelude::*;

/// The constants of a shader that are true or false, all of them set.
fn all_set(module: &Module) -> PipelineConstants {
    let overrides = module.overrides.iter().map(|(_, constant)| constant);
    let switches = overrides.filter(|constant| match module.types[constant.ty].inner {
        TypeInner::Scalar(scalar) => scalar.kind == ScalarKind::Bool,
        _ => false,
    });
    let names = switches.filter_map(|constant| constant.name.clone());
    names.map(|name| (name, 1.0)).collect()
}

fn to_spirv(module: &Module, info: &ModuleInfo, stage: ShaderStage, entry: &str) -> String {
    let pipeline = spv::PipelineOptions {
        shader_stage: stage,
        entry_point: entry.to_string(),
    };
    let words = spv::write_vec(module, info, &spv::Options::default(), Some(&pipeline)).unwrap();
    words.len().to_string()
}

fn to_msl(module: &Module, info: &ModuleInfo, stage: ShaderStage, entry: &str) -> String {
    let options = msl::Options {
        lang_version: (2, 4),
        ..msl::Options::default()
    };
    let pipeline = msl::PipelineOptions {
        entry_point: Some((stage, entry.to_string())),
        ..msl::PipelineOptions::default()
    };
    let (text, found) = msl::write_string(module, info, &options, &pipeline).unwrap();
    found.entry_point_names.into_iter().for_each(|name| {
        name.unwrap();
    });
    text
}

fn to_hlsl(module: &Module, info: &ModuleInfo, stage: ShaderStage, entry: &str) -> String {
    let options = hlsl::Options {
        shader_model: hlsl::ShaderModel::V6_6,
        ..hlsl::Options::default()
    };
    let pipeline = hlsl::PipelineOptions {
        entry_point: Some((stage, entry.to_string())),
    };
    let mut text = String::new();
    let mut writer = hlsl::Writer::new(&mut text, &options, &pipeline);
    let found = writer.write(module, info, None).unwrap();
    found.entry_point_names.into_iter().for_each(|name| {
        name.unwrap();
    });
    text
}

#[test]
fn every_pipeline_is_in_the_languages_of_all_backends() {
    let count = MODULES.par_iter().map(|(shader, module)| {
        let info = validated(*shader, module);
        for constants in [PipelineConstants::default(), all_set(module)] {
            for entry in &module.entry_points {
                let (stage, name) = (entry.stage, entry.name.as_str());
                let compiled = process_overrides(module, &info, Some((stage, name)), &constants);
                let (module, info) = compiled.unwrap_or_else(|e| panic!("{shader:?} {name}: {e}"));
                for translate in [to_spirv, to_msl, to_hlsl] {
                    assert!(!translate(&module, &info, stage, name).is_empty());
                }
            }
        }
        2 * module.entry_points.len()
    });
    let count: usize = count.sum();
    assert!(count > 500, "{count}");
}
