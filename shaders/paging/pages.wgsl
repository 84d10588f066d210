// A level of a map, cut into pages: squares of texels, of which only those are stored that lookups ask for. In each page
// the texels are in rows.
#import lib/fine_tiles

struct Pages {
    shift: u32,                         // binary logarithm of the texels along a page's side
    columns: u32,                       // of pages along each side of the map
    coarse_columns: u32,                // of the coarse tiles that the rasterizer cuts triangles into
    number: u32,                        // of the level among those of all maps, from 1 on
    first_bit: u32,                     // of its pages among those of all levels
}

struct PageTable {
    // 1 where no texel is looked at, but its page is asked for. Not in the uniform, as it turns within a frame: Mesa 22.3's
    // llvmpipe compiles a shader anew where a uniform decides most of what it does, and frees none.
    asks: u32,
    // Of each page, in rows, its place among those that are stored, or ABSENT. Then of each coarse tile whether it has any.
    places: array<u32>,
}

@group(0) @binding(26) var<uniform> pages_uniform: Pages;
@group(0) @binding(9) var<storage, read> page_table: PageTable;
// A bit for each page of each level that is asked for.
@group(0) @binding(27) var<storage, read_write> page_requests: array<atomic<u32>>;
// Of each pixel the number of its level, zero where it needs none.
@group(0) @binding(28) var<storage, read> level_of_pixel: array<u32>;

// In place of an index.
const ABSENT: u32 = 0xffffffffu;

// Of a square of `1 << size_shift` texels or tiles to the page's side, the place of one in memory.
fn index_in_page(pages: Pages, place: vec2<u32>, size_shift: u32) -> u32 {
    let page = place >> vec2<u32>(size_shift);
    let within = place - (page << vec2<u32>(size_shift));
    let slot = page_table.places[page.y * pages.columns + page.x];
    let index = (((slot << size_shift) + within.y) << size_shift) + within.x;
    return select(index, ABSENT, slot == ABSENT);
}

fn index_of_texel(projection: Projection, texel: vec2<u32>) -> u32 {
    let pages = pages_uniform;
    return index_in_page(pages, texel, pages.shift);
}

// Whether a texel or a tile with that index is stored.
fn is_stored(index: u32) -> bool {
    return index != ABSENT;
}

// Of the tiles from `first` to `last`, which are neighbours or one.
fn indices_of_tiles(projection: Projection, first: vec2<u32>, last: vec2<u32>) -> vec4<u32> {
    let pages = pages_uniform;
    let shift = pages.shift - FINE_SHIFT;
    return vec4<u32>(
        index_in_page(pages, first, shift),
        index_in_page(pages, vec2<u32>(last.x, first.y), shift),
        index_in_page(pages, vec2<u32>(first.x, last.y), shift),
        index_in_page(pages, last, shift),
    );
}

// Whether a receiver looks at one of four tiles, by their indices.
fn are_looked_at(tiles: vec4<u32>) -> bool {
    return any(tiles != vec4<u32>(ABSENT));
}

// Whether anything is stored of a coarse tile, and of a block of texels in it, which is no larger than a page.
fn has_coarse_tile(tile: vec2<u32>) -> bool {
    let pages = pages_uniform;
    return page_table.places[pages.columns * pages.columns + tile.y * pages.coarse_columns + tile.x] != 0u;
}

fn has_block(projection: Projection, first: vec2<u32>) -> bool {
    return is_stored(index_of_texel(projection, first));
}

// ---- for lookups ----

// Whether a pixel looks into the level.
fn is_chosen(pixel: u32) -> bool {
    return level_of_pixel[pixel] == pages_uniform.number;
}

// Whether nothing is looked at.
fn is_asking() -> bool {
    return page_table.asks != 0u;
}

// Who asks is told that nothing is there. It is one pipeline that asks and that looks, so that both round alike.
fn index_looked_at(projection: Projection, texel: vec2<u32>) -> u32 {
    let pages = pages_uniform;
    if page_table.asks != 0u {
        let page = texel >> vec2<u32>(pages.shift);
        ask(pages.first_bit + page.y * pages.columns + page.x);
        return ABSENT;
    }
    return index_in_page(pages, texel, pages.shift);
}

fn ask(page: u32) {
    let bit = 1u << (page & 31u);
    // A word that nobody writes to stays in the caches of all.
    if (atomicLoad(&page_requests[page >> 5u]) & bit) == 0u {
        atomicOr(&page_requests[page >> 5u], bit);
    }
}
