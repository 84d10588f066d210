// What is known of a masked triangle at a point.

struct Solidity {
    may_be: bool,               // whether the surface may be there
    is_sure: bool,              // whether it is, whatever rounding did
}
