// Invocations that are counted along one line: workgroups stand in rows, because a device takes at most 65,535 of
// them along an axis. Rows have one length, as in kernel.rs: `num_workgroups` is zero in the indirect dispatches of
// DirectX 12.

const GROUP: u32 = 64u;
const GROUPS_OF_ROW: u32 = 32768u;

struct Invocation {
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
}

// The number of an invocation among all, or of the first of its items where a workgroup takes `size` of them.
fn index_of_invocation(invocation: Invocation, size: u32) -> u32 {
    return (invocation.group.y * GROUPS_OF_ROW + invocation.group.x) * size + invocation.local;
}

// Arguments of an indirect dispatch of at least so many invocations.
fn groups_for(count: u32) -> array<u32, 3> {
    let groups = (count + GROUP - 1u) / GROUP;
    let width = clamp(groups, 1u, GROUPS_OF_ROW);
    return array<u32, 3>(width, (groups + width - 1u) / width, 1u);
}
