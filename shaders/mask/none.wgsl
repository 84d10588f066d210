// No triangle has holes.
#import lib/solidity

fn is_masked(triangle: u32) -> bool {
    return false;
}

fn is_solid(triangle: u32, shares: vec3<f32>) -> bool {
    return true;
}

fn solidity_of(triangle: u32, shares: vec3<f32>, error: f32) -> Solidity {
    return Solidity(true, true);
}
