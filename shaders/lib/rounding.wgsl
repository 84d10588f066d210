// What float32 rounds, argued once; src/rounding.rs is its twin. One number is rounded by 2^-24 of it at most.

// Of a position, as a share of its distance: eight times that. A coordinate is rounded, then goes through two or
// three more operations. The reference takes no offence at what turns within it.
const ROUNDING: f32 = 1.0 / 2097152.0;
// Of a sum of two or three products, as a share of the products: each is rounded, as is their sum, and one to spare.
const PRODUCT_ROUNDING: f32 = 0.5 * ROUNDING;
// Of a linear function of the texel, an edge's or a plane's, as a share of the sizes of its terms: its coefficients
// come of a matrix, two differences and products, some thirty times 2^-24 in all.
const FUNCTION_ROUNDING: f32 = 2e-6;
// Of places in texels: a map of 16,384 texels rounds them by a thousandth of a texel, and they go through ten
// operations at most. A texel's centre that is so near to an edge is looked at.
const TEXEL_ROUNDING: f32 = 0.01;
// Of what a short chain of operations gives, of unit vectors or of a place far off the map, as a share of its size.
const SHORT_ROUNDING: f32 = 0.5 * FUNCTION_ROUNDING;
