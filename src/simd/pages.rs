//! Large pages for large tables.
//!
//! Rays jump about in a tree, and a processor remembers the places of some thousand pages. Linux holds memory in pages of
//! 2 MiB rather than 4 KiB where that is asked for (transparent huge pages, `madvise`, its default in most distributions).

/// Bytes of a large page.
#[cfg(target_os = "linux")]
const LARGE_PAGE: usize = 2 << 20;

/// Asks for the memory that a table has room for to come in large pages, before it is written. It is a hint: whether it is
/// followed shows in nothing but time.
#[cfg(target_os = "linux")]
pub fn prefer_large_pages<T>(table: &mut Vec<T>) {
    let n_bytes = table.capacity() * size_of::<T>();
    advise(table.as_mut_ptr().cast(), n_bytes, libc::MADV_HUGEPAGE);
}

/// Puts a table into large pages that lies in memory which was used before, and so in small ones (Linux 6.1); a hint like
/// [`prefer_large_pages`]. It costs a copy of what is moved.
#[cfg(target_os = "linux")]
pub fn move_to_large_pages<T>(table: &mut [T]) {
    advise(table.as_mut_ptr().cast(), size_of_val(table), libc::MADV_COLLAPSE);
}

/// Gives one of these two hints about all large pages that lie in some memory as a whole: others gain nothing.
#[cfg(target_os = "linux")]
fn advise(memory: *mut u8, n_bytes: usize, hint: libc::c_int) {
    let begin = memory as usize;
    let (first, last) = (begin.next_multiple_of(LARGE_PAGE), (begin + n_bytes) / LARGE_PAGE * LARGE_PAGE);
    if first < last {
        // SAFETY: both hints may be given about any memory, mapped or not: they change neither what it holds nor which may be
        // accessed (madvise(2)). An error means that there are no large pages, and nothing else.
        let _ = unsafe { libc::madvise(memory.wrapping_add(first - begin).cast(), last - first, hint) };
    }
}

/// Here tables lie in pages of one size.
#[cfg(not(target_os = "linux"))]
pub fn prefer_large_pages<T>(_table: &mut Vec<T>) {}

/// See [`prefer_large_pages`].
#[cfg(not(target_os = "linux"))]
pub fn move_to_large_pages<T>(_table: &mut [T]) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_any_size_hold_what_they_held() {
        for n in [0, 1, 1000, 9 << 20] {
            let mut table: Vec<u8> = Vec::with_capacity(n as usize);
            prefer_large_pages(&mut table);
            table.extend((0..n).map(|i| (i % 251) as u8));
            let is_whole = |table: &[u8]| table.iter().zip(0..n).all(|(&x, i)| u32::from(x) == i % 251);
            assert!(is_whole(&table), "{n}");
            prefer_large_pages(&mut table);
            move_to_large_pages(&mut table);
            move_to_large_pages(&mut table[n as usize / 3..]);
            assert!(is_whole(&table), "{n}");
        }
    }
}
