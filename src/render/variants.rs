//! Frames on devices that do what drivers may do: workgroups in another order, scratch memory that holds anything, work
//! that is shared out as on a GPU, and quotients and roots that are rounded as WGSL allows.

use super::tests::{floor_and_squares, looking_down, shadows, sun, wrong_pixels};
use super::*;
use crate::bvh::Everything;
use crate::gpu::device::Variant;
use crate::reference::reference;
use crate::twin::Random;
use glam::DVec3;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{
    BinaryOperator, Expression, Function, Handle, MathFunction, Module, ScalarKind, TypeInner,
};
use std::collections::HashMap;
use std::ops::Range;

/// How many numbers each expression of a function has whose value is a float or a vector of floats.
type Counts = HashMap<Handle<Expression>, usize>;

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

/// Does something for every expression of a function whose value is a float or a vector of floats: what it is, the
/// function, and the numbers of each such expression of it.
fn for_floats(source: &str, mut visit: impl FnMut(Handle<Expression>, &Function, &Counts)) {
    let module: Module = naga::front::wgsl::parse_str(source).unwrap();
    let info = Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module);
    let info = info.unwrap();
    let functions = module
        .functions
        .iter()
        .map(|(handle, f)| (f, &info[handle]));
    let entries = module.entry_points.iter().enumerate();
    let entries = entries.map(|(i, entry)| (&entry.function, info.get_entry_point(i)));
    for (function, info) in functions.chain(entries) {
        let counts = function.expressions.iter().filter_map(|(handle, _)| {
            let count = match *info[handle].ty.inner_with(&module.types) {
                TypeInner::Scalar(scalar) if scalar.kind == ScalarKind::Float => 1,
                TypeInner::Vector { size, scalar } if scalar.kind == ScalarKind::Float => {
                    size as usize
                }
                _ => return None,
            };
            Some((handle, count))
        });
        let counts: Counts = counts.collect();
        for (handle, _) in function.expressions.iter() {
            if counts.contains_key(&handle) {
                visit(handle, function, &counts);
            }
        }
    }
}

/// Where an expression stands in the source, if it does.
fn span_of(source: &str, function: &Function, handle: Handle<Expression>) -> Option<Range<usize>> {
    let span = function.expressions.get_span(handle).to_range()?;
    // Of a call it is the name alone.
    Some(span.start..span.end + length_of_arguments(&source[span.end..]))
}

/// Where quotients and roots stand in the source, and how many numbers each is.
fn quotients_and_roots(source: &str) -> Vec<(Range<usize>, usize)> {
    let mut found = Vec::new();
    for_floats(source, |handle, function, counts| {
        let is_rounded = match &function.expressions[handle] {
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
        if is_rounded {
            let span = span_of(source, function, handle).unwrap();
            found.push((span, counts[&handle]));
        }
    });
    found
}

/// What stands in the place of an expression: text, and other parts of the source.
enum Piece {
    Text(&'static str),
    Source(Range<usize>),
}

/// The source, or a part of it, with all replacements in it; of those that overlap the outermost, and those in its parts.
fn replaced(source: &str, whole: Range<usize>, all: &[(Range<usize>, Vec<Piece>)]) -> String {
    let mut text = String::new();
    let mut place = whole.start;
    // Sorted by their starts, longer ones first.
    for (span, pieces) in all {
        if span.start < place || span.end > whole.end {
            continue;
        }
        text.push_str(&source[place..span.start]);
        for piece in pieces {
            match piece {
                Piece::Text(piece) => text.push_str(piece),
                Piece::Source(part) => text.push_str(&replaced(source, part.clone(), all)),
            }
        }
        place = span.end;
    }
    text + &source[place..whole.end]
}

fn with_replacements(source: &str, mut all: Vec<(Range<usize>, Vec<Piece>)>) -> String {
    all.sort_by_key(|(span, _)| (span.start, usize::MAX - span.end));
    replaced(source, 0..source.len(), &all)
}

/// A sum or a difference of floats: whether the right side is subtracted, and both sides.
fn sum_of(
    function: &Function,
    handle: Handle<Expression>,
    counts: &Counts,
) -> Option<(bool, [Handle<Expression>; 2])> {
    match function.expressions[handle] {
        Expression::Binary { op, left, right } if counts.contains_key(&handle) => match op {
            BinaryOperator::Add => Some((false, [left, right])),
            BinaryOperator::Subtract => Some((true, [left, right])),
            _ => None,
        },
        _ => None,
    }
}

/// Where the sides of an operator stand in an expression. What has a name stands elsewhere, its name here.
fn spans_of_sides(
    source: &str,
    function: &Function,
    whole: &Range<usize>,
    sides: [Handle<Expression>; 2],
) -> [Range<usize>; 2] {
    let [left, right] = sides.map(|side| {
        span_of(source, function, side)
            .filter(|span| whole.start <= span.start && span.end <= whole.end)
    });
    let from = left.as_ref().map_or(whole.start, |left| left.end);
    let to = right.as_ref().map_or(whole.end, |right| right.start);
    let operator = from + source[from..to].find(['+', '-', '*']).unwrap();
    let trimmed = |range: Range<usize>| {
        let text = source[range.clone()].trim_end();
        let end = range.start + text.len();
        end - text.trim_start().len()..end
    };
    [
        left.unwrap_or_else(|| trimmed(whole.start..operator)),
        right.unwrap_or_else(|| trimmed(operator + 1..whole.end)),
    ]
}

/// The terms of a sum that stand in its own expression, and whether each is subtracted.
fn terms_of(
    source: &str,
    function: &Function,
    counts: &Counts,
    (handle, span, is_subtracted): (Handle<Expression>, Range<usize>, bool),
    terms: &mut Vec<(Range<usize>, bool)>,
) {
    // Only what stands here, not what has a name.
    let sum = sum_of(function, handle, counts)
        .filter(|_| span_of(source, function, handle).as_ref() == Some(&span));
    let Some((is_difference, sides)) = sum else {
        return terms.push((span, is_subtracted));
    };
    let spans = spans_of_sides(source, function, &span, sides);
    let are_subtracted = [is_subtracted, is_subtracted != is_difference];
    for ((side, span), is_subtracted) in sides.into_iter().zip(spans).zip(are_subtracted) {
        terms_of(source, function, counts, (side, span, is_subtracted), terms);
    }
}

/// With the terms of each sum added up from the last one to the first, as compilers with fast mathematics may.
fn backward_sums(source: String) -> String {
    let mut all = Vec::new();
    for_floats(&source, |handle, function, counts| {
        let mut terms = Vec::new();
        let Some(span) = span_of(&source, function, handle) else {
            return;
        };
        terms_of(
            &source,
            function,
            counts,
            (handle, span.clone(), false),
            &mut terms,
        );
        if terms.len() < 3 {
            return;
        }
        let mut pieces = vec![Piece::Text("(")];
        for (i, (span, is_subtracted)) in terms.into_iter().rev().enumerate() {
            pieces.push(Piece::Text(match (i, is_subtracted) {
                (0, false) => "(",
                (0, true) => "-(",
                (_, false) => " + (",
                (_, true) => " - (",
            }));
            pieces.extend([Piece::Source(span), Piece::Text(")")]);
        }
        pieces.push(Piece::Text(")"));
        all.push((span, pieces));
    });
    with_replacements(&source, all)
}

/// With each product that is added to something rounded together with the sum, as compilers may contract them.
fn contracted(source: String) -> String {
    let mut all = Vec::new();
    for_floats(&source, |handle, function, counts| {
        let Some((is_difference, sides)) = sum_of(function, handle, counts) else {
            return;
        };
        let Some(whole) = span_of(&source, function, handle) else {
            return;
        };
        let spans = spans_of_sides(&source, function, &whole, sides);
        for (product, is_right) in [(0, false), (1, true)] {
            let Expression::Binary {
                op: BinaryOperator::Multiply,
                left,
                right,
            } = function.expressions[sides[product]]
            else {
                continue;
            };
            let other = 1 - product;
            let span = span_of(&source, function, sides[product]);
            let has_a_name = span.as_ref() != Some(&spans[product]);
            // A number that stands for a vector of it is none in the source.
            let is_unlike = |part: &Handle<Expression>| {
                let is_spread = matches!(function.expressions[*part], Expression::Splat { .. });
                is_spread || counts.get(part) != counts.get(&handle)
            };
            if has_a_name || [left, right, sides[other]].iter().any(is_unlike) {
                continue;
            }
            let signs = match (is_difference, is_right) {
                (false, _) => ["fma((", "), (", "), (", "))"],
                (true, false) => ["fma((", "), (", "), -(", "))"],
                (true, true) => ["fma(-(", "), (", "), (", "))"],
            };
            let [first, second, third, end] = signs.map(Piece::Text);
            let [left, right] = spans_of_sides(&source, function, &spans[product], [left, right])
                .map(Piece::Source);
            let other = Piece::Source(spans[other].clone());
            all.push((whole, vec![first, left, second, right, third, other, end]));
            break;
        }
    });
    with_replacements(&source, all)
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
fn neither_the_order_of_workgroups_nor_their_work_nor_old_memory_changes_a_byte() {
    // Its receivers are at any depth, and so what they are worth differs within a cell.
    let (scene, camera) = (needles(1), looking_down());
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
        Variant {
            is_gpu: true,
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
        ("virtual", &sun),
        ("virtual", &lamp),
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
fn neither_rounded_quotients_nor_other_sums_change_an_exact_shadow() {
    let rewriting = |rewrite| {
        Gpu::variant(Variant {
            rewrite,
            ..Variant::default()
        })
    };
    let camera = looking_down();
    let wrong = |gpu: &Arc<Gpu>, name: &str| {
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
    for rewrite in [rounded, backward_sums, contracted] {
        let gpu = rewriting(rewrite);
        for name in ["exact", "ray_traced"] {
            assert_eq!(wrong(&gpu, name), 0, "{name}");
        }
    }
    // What is rewritten is run.
    assert!(wrong(&rewriting(coarse), "exact") > 0);
}

#[test]
fn sums_are_rewritten_with_all_of_their_terms() {
    let source = |value| {
        format!(
            "fn f(a: f32, b: f32, c: f32, v: vec2f, i: u32) -> f32 {{\n    let s = a - b;\n    return {value};\n}}\n"
        )
    };
    let value = |text: String| {
        let (_, text) = text.split_once("return ").unwrap();
        text.split_once(';').unwrap().0.to_string()
    };
    for (before, after) in [
        ("(a - b) + c - v.x", "(-(v.x) + (c) - (b) + (a))"),
        ("a - (b - sqrt(c))", "((sqrt(c)) - (b) + (a))"),
        ("a * (a + b + c)", "a * (((c) + (b) + (a)))"),
        ("b + (s) - c", "(-(c) + ((s)) + (b))"),
        ("a + b", "a + b"),
        ("f32(i + 2u + i)", "f32(i + 2u + i)"),
    ] {
        assert_eq!(value(backward_sums(source(before))), after);
    }
    for (before, after) in [
        ("a * b + c", "fma((a), (b), (c))"),
        ("a * s - s", "fma((a), (s), -(s))"),
        (
            "a - b * (a * b + c)",
            "fma(-(b), (fma((a), (b), (c))), (a))",
        ),
        ("a + (v * b).x", "a + (v * b).x"),
    ] {
        assert_eq!(value(contracted(source(before))), after);
    }
}
