//! Frames on devices that do what drivers may do: workgroups in another order, scratch memory that holds anything, and
//! quotients and roots that are rounded as WGSL allows.

use super::tests::{floor_and_squares, looking_down, shadows, sun, wrong_pixels};
use super::*;
use crate::bvh::Everything;
use crate::gpu::device::Variant;
use crate::reference::reference;
use crate::twin::Random;
use glam::DVec3;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{BinaryOperator, Expression, MathFunction, Module, ScalarKind, TypeInner};
use std::ops::Range;

/// Counts workgroups from the last one.
fn reversed(source: String) -> String {
    let group = "@builtin(workgroup_id) group: vec3<u32>";
    let of_all = "@builtin(global_invocation_id) invocation: vec3<u32>";
    let groups = "@builtin(num_workgroups) every_group: vec3<u32>";
    let (mut lines, mut size) = (Vec::new(), "");
    let (mut is_struct, mut pending) = (false, None);
    for line in source.lines() {
        is_struct = line == "struct Invocation {" || is_struct && line != "}";
        if let Some((_, found)) = line.split_once("@workgroup_size(") {
            size = found.trim_end_matches(')');
        }
        let mut line = line.to_string();
        if is_struct {
            line = line.replace(group, &format!("{group}, {groups}"));
        } else if line.contains(group) {
            let backward = group.replace(" group:", " backward:");
            line = line.replace(group, &format!("{backward}, {groups}"));
            pending = Some("let group = every_group - 1u - backward;".to_string());
        } else if line.contains(of_all) {
            let backward = of_all.replace(" invocation:", " backward:");
            line = line.replace(of_all, &format!("{backward}, {groups}"));
            let size = match size.contains(',') {
                true => format!("vec3<u32>({size}, 1u)"),
                false => format!("vec3<u32>({size}, 1u, 1u)"),
            };
            pending = Some(format!(
                "let invocation = every_group * {size} - 1u - backward;"
            ));
        }
        for axis in ["x", "y"] {
            let (own, all) = (
                format!("invocation.group.{axis}"),
                format!("every_group.{axis}"),
            );
            line = line.replace(&own, &format!("(invocation.{all} - 1u - {own})"));
        }
        let is_head = line.ends_with('{');
        lines.push(line);
        lines.extend(pending.take_if(|_| is_head));
    }
    lines.join("\n") + "\n"
}

/// What a quotient or a root is wrapped in: by its bits up to two `UNITS` to either side.
const ROUNDED: &str = "
fn rounded1(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    let exponent = (bits >> 23u) & 255u;
    let step = ((bits * 2654435769u) >> 29u) % 5u;
    return select(bitcast<f32>(bits + step * UNITS - 2u * UNITS), x, exponent < 2u || exponent > 253u);
}
fn rounded2(v: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(rounded1(v.x), rounded1(v.y));
}
fn rounded3(v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(rounded1(v.x), rounded1(v.y), rounded1(v.z));
}
fn rounded4(v: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(rounded2(v.xy), rounded2(v.zw));
}
";

/// How long the parentheses are that a text begins with, if it does.
fn length_of_arguments(text: &str) -> usize {
    let mut depth = 0;
    for (i, letter) in text.char_indices() {
        match letter {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        if depth <= 0 {
            return if i == 0 { 0 } else { i + 1 };
        }
    }
    0
}

/// Where quotients and roots stand in the source, and how many numbers each is.
fn quotients_and_roots(source: &str) -> Vec<(Range<usize>, usize)> {
    let module: Module = naga::front::wgsl::parse_str(source).unwrap();
    let info = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module);
    let info = info.unwrap();
    let functions = module
        .functions
        .iter()
        .map(|(handle, f)| (f, &info[handle]));
    let entries = module.entry_points.iter().enumerate();
    let entries = entries.map(|(i, entry)| (&entry.function, info.get_entry_point(i)));
    let mut found = Vec::new();
    for (function, info) in functions.chain(entries) {
        for (handle, expression) in function.expressions.iter() {
            let is_rounded = match expression {
                Expression::Binary { op, .. } => *op == BinaryOperator::Divide,
                Expression::Math { fun, .. } => matches!(
                    fun,
                    MathFunction::Sqrt
                        | MathFunction::InverseSqrt
                        | MathFunction::Length
                        | MathFunction::Distance
                        | MathFunction::Normalize
                ),
                _ => false,
            };
            let count = match *info[handle].ty.inner_with(&module.types) {
                TypeInner::Scalar(scalar) if scalar.kind == ScalarKind::Float => 1,
                TypeInner::Vector { size, scalar } if scalar.kind == ScalarKind::Float => {
                    size as usize
                }
                _ => continue,
            };
            if is_rounded {
                let span = function.expressions.get_span(handle).to_range().unwrap();
                // Of a call it is the name alone.
                let end = span.end + length_of_arguments(&source[span.end..]);
                found.push((span.start..end, count));
            }
        }
    }
    found
}

/// With quotients and roots that are up to two units in the last place off, as in WGSL they may be by 2.5.
fn rounded(source: String) -> String {
    rounded_by(source, 1)
}

fn coarse(source: String) -> String {
    rounded_by(source, 1 << 14)
}

fn rounded_by(source: String, units: u32) -> String {
    let mut inserted = Vec::new();
    for (span, count) in quotients_and_roots(&source) {
        let length = span.len();
        inserted.push((span.start, usize::MAX - length, format!("rounded{count}(")));
        inserted.push((span.end, 0, ")".to_string()));
    }
    // From the end on; at one place an inner one is inserted before the outer one.
    inserted.sort();
    let mut whole = source;
    for (place, _, text) in inserted.iter().rev() {
        whole.insert_str(*place, text);
    }
    format!("{whole}{ROUNDED}const UNITS = {units}u;\n")
}

fn lights() -> [Light; 3] {
    let place = DVec3::new(0.4, 3.0, 0.7);
    [
        sun(),
        Light::point(place).unwrap(),
        Light::spot(place, DVec3::NEG_Y, 0.9).unwrap(),
    ]
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn neither_the_order_of_workgroups_nor_old_memory_changes_a_byte() {
    let (scene, camera) = (floor_and_squares(4.0), looking_down());
    let [sun, lamp, _] = lights();
    let plain = Gpu::variant(Variant::default());
    let variants = [
        Variant {
            rewrite: reversed,
            ..Variant::default()
        },
        Variant {
            spoils_scratch: true,
            ..Variant::default()
        },
    ];
    let variants = variants.map(Gpu::variant);
    // Between them they record every pass that all methods record.
    for (name, light) in [
        ("desired_view", &sun),
        ("cascades", &sun),
        ("scene_optimized", &sun),
        ("rtw", &sun),
        ("notw", &sun),
        ("cube", &lamp),
        ("dual_paraboloid", &lamp),
        ("exact", &lamp),
        ("ray_traced", &lamp),
        ("shadow_volumes", &lamp),
    ] {
        let bits = |gpu| {
            let image = shadows(gpu, (&scene, &camera, light), name).unwrap();
            image.into_iter().map(f32::to_bits).collect::<Vec<_>>()
        };
        let expected = bits(&plain);
        for (i, gpu) in variants.iter().enumerate() {
            assert!(bits(gpu) == expected, "{name}, {i}");
        }
    }
}

/// Thin triangles over a floor.
fn needles(seed: u64) -> Scene {
    let mut random = Random(seed);
    let mut vector = || DVec3::from_array([0; 3].map(|_| 2.0 * random.share() - 1.0));
    let mut corners = vec![
        DVec3::new(-4.0, 0.0, -4.0),
        DVec3::new(-4.0, 0.0, 8.0),
        DVec3::new(8.0, 0.0, -4.0),
    ];
    for _ in 0..300 {
        let (place, way) = (vector() * DVec3::new(3.0, 0.8, 3.0) + DVec3::Y, vector());
        corners.extend([place, place + way, place + way + 0.02 * vector()]);
    }
    let triangles = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Scene::new(corners, triangles.collect()).unwrap()
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn rounded_quotients_change_no_exact_shadow() {
    let rewriting = |rewrite| {
        Gpu::variant(Variant {
            rewrite,
            ..Variant::default()
        })
    };
    let camera = looking_down();
    let wrong = |gpu, name| {
        let mut count = 0;
        for scene in [floor_and_squares(4.0), needles(1)] {
            for light in lights() {
                let truth = reference(&scene, &Everything(&scene), &camera, &light);
                let found = shadows(gpu, (&scene, &camera, &light), name).unwrap();
                count += wrong_pixels(&found, &truth);
            }
        }
        count
    };
    let gpu = rewriting(rounded);
    for name in ["exact", "ray_traced"] {
        assert_eq!(wrong(&gpu, name), 0, "{name}");
    }
    // What is rewritten is run.
    assert!(wrong(&rewriting(coarse), "exact") > 0);
}
