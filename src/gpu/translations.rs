//! Every entry point of every shader in the languages of the backends: what their drivers get to compile.

use super::shaders::tests::{MODULES, validated};
use naga::back::{PipelineConstants, hlsl, msl, pipeline_constants::process_overrides, spv};
use naga::valid::ModuleInfo;
use naga::{Module, ScalarKind, ShaderStage, TypeInner};
use rayon::prelude::*;
use std::io::Write;
use std::process::{Command, Stdio};

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

/// What the validator of Khronos has to say against a module, all of its entry points together.
fn refused_by_validator(module: &Module, info: &ModuleInfo) -> Option<String> {
    let options = spv::Options {
        // The oldest that ray queries are in.
        lang_version: (1, 4),
        ..spv::Options::default()
    };
    let words = spv::write_vec(module, info, &options, None).unwrap();
    let mut validator = Command::new("spirv-val")
        .args(["--target-env", "vulkan1.2", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = validator.stdin.take().unwrap();
    input.write_all(bytemuck::cast_slice(&words)).unwrap();
    drop(input);
    let output = validator.wait_with_output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    (!output.status.success()).then(|| String::from_utf8_lossy(&said).into_owned())
}

#[test]
#[ignore = "runs spirv-val: LIXEL_DEVICE=gpu"]
fn the_spirv_of_every_pipeline_is_valid() {
    if Command::new("spirv-val").arg("--version").output().is_err() {
        // Where the script installs what tests need, it is there.
        if cfg!(target_os = "linux") {
            panic!("spirv-val is missing");
        }
        return;
    }
    MODULES.par_iter().for_each(|(shader, module)| {
        let info = validated(*shader, module);
        for constants in [PipelineConstants::default(), all_set(module)] {
            let (module, info) = process_overrides(module, &info, None, &constants).unwrap();
            let refused = refused_by_validator(&module, &info);
            assert_eq!(refused, None, "{shader:?}");
        }
    });
    // It knows what is wrong.
    let (shader, module) = &MODULES[0];
    let info = validated(*shader, module);
    let constants = PipelineConstants::default();
    let (module, info) = process_overrides(module, &info, None, &constants).unwrap();
    let mut module = module.into_owned();
    for (_, variable) in module.global_variables.iter_mut() {
        variable.binding = None;
    }
    assert!(refused_by_validator(&module, &info).is_some());
}
