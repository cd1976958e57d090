// Finds where each layer of each instance stands in its clip, by integers alone up to the last step.
// Twin: src/twin/crowd_times.rs.

// `index_in_window` is a time base of an entry, of those of the window.
fn crowd_work(index_in_window: u32) {
    let layer = index_in_window / dispatch.bases;
    let base_index = index_in_window - layer * dispatch.bases;
    let entry = entries[dispatch.first_instance * dispatch.layers + layer];
    let clip = clips[entry.clip_and_weight & 0xffffu];
    if base_index < clip.bases {
        let tick = tick_of(entry, clip.period);
        let base = time_bases[clip.first_base + base_index];
        let index = span_at(base, tick);
        let span = spans[base.first + index];
        let distance = distance_from_middle(i32(tick) - span.whole, 0u);
        let is_key = span.start == (tick | ON_KEY);
        positions[index_in_window].span = index | select(0u, ON_KEY, is_key);
        positions[index_in_window].parameter = distance * span.scale + span.offset;
    }
}
