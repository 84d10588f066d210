// What the entry points of a rasterization count. A length goes on beyond the capacity of its list: the host then makes
// room and runs again.

struct Counters {
    items: atomic<u32>,                 // small triangles, and parts of large ones
    coarse_items: atomic<u32>,          // coarse parts of large triangles
    outside: atomic<u32>,               // triangles that touch nothing of the map
    behind: atomic<u32>,                // triangles outside the range of depths
    hidden: atomic<u32>,                // items that lie behind others
    pieces: atomic<u32>,                // of triangles, for a linear rasterization
    current_unfinished: u32,            // pieces of this round of splitting
    next_unfinished: atomic<u32>,       // and of the next one
    most_unfinished: u32,               // of all rounds
    lost: atomic<u32>,                  // pieces that found no room
    is_linear: u32,                     // 1 where pieces, not triangles, are counted
}
