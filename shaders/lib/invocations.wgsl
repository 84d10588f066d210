// Invocations that are counted along one line: workgroups stand in rows, because a device takes at most 65,535 of
// them along an axis.

const GROUP: u32 = 64u;

struct Invocation {
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
}

// The number of an invocation among all, or of the first of its items where a workgroup takes `size` of them.
fn index_of_invocation(invocation: Invocation, size: u32) -> u32 {
    return (invocation.group.y * invocation.groups.x + invocation.group.x) * size + invocation.local;
}

// Arguments of an indirect dispatch of at least so many invocations.
fn groups_for(count: u32) -> array<u32, 3> {
    let groups = (count + GROUP - 1u) / GROUP;
    let width = max(min(groups, 32768u), 1u);
    return array<u32, 3>(width, (groups + width - 1u) / width, 1u);
}
