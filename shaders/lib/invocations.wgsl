// The number of an invocation among all, or of the first of its items where a workgroup takes `size` of
// them: workgroups stand in rows, because a device takes at most 65,535 of them along an axis.
fn index_of_invocation(group: vec3<u32>, groups: vec3<u32>, size: u32, local: u32) -> u32 {
    return (group.y * groups.x + group.x) * size + local;
}
