// Lists of work that one entry point makes for the next, so that large and small triangles are even work:
//
//   bin    a triangle an invocation: culls, and lists the rest: an item for a small triangle, coarse
//          parts of a large one;
//   split  a coarse part an invocation: lists the items in it;
//   walk   items to the work itself.
//
// `prepare_split` and `prepare_walk` set the number of workgroups of the next in between.
#import lib/counters
#import lib/invocations

// A triangle and a part of it, which the shader encodes.
struct Item {
    triangle: u32,
    part: u32,
}

@group(0) @binding(4) var<storage, read_write> counters: Counters;
@group(0) @binding(6) var<storage, read_write> items: array<Item>;
@group(0) @binding(7) var<storage, read_write> coarse_items: array<Item>;
// Arguments of the indirect dispatch that follows.
@group(0) @binding(8) var<storage, read_write> groups_of_next: array<u32, 3>;

override items_per_invocation: u32 = 1u;

fn append_item(triangle: u32, part: u32) {
    let slot = atomicAdd(&counters.items, 1u);
    if slot < arrayLength(&items) {
        items[slot] = Item(triangle, part);
    }
}

fn append_coarse_item(triangle: u32, part: u32) {
    let slot = atomicAdd(&counters.coarse_items, 1u);
    if slot < arrayLength(&coarse_items) {
        coarse_items[slot] = Item(triangle, part);
    }
}

fn item_count() -> u32 {
    return min(atomicLoad(&counters.items), arrayLength(&items));
}

fn coarse_item_count() -> u32 {
    return min(atomicLoad(&counters.coarse_items), arrayLength(&coarse_items));
}

@compute @workgroup_size(1)
fn prepare_split() {
    groups_of_next = groups_for(coarse_item_count());
}

@compute @workgroup_size(1)
fn prepare_walk() {
    groups_of_next = groups_for((item_count() + items_per_invocation - 1u) / items_per_invocation);
}
