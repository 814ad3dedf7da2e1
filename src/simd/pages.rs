//! Large pages for large tables.
//!
//! Rays jump about in a tree, and a processor remembers the places of some thousand pages. Linux holds memory in pages of
//! 2 MiB rather than 4 KiB where that is asked for (transparent huge pages, `madvise`, its default in most distributions).

/// Bytes of a large page.
#[cfg(target_os = "linux")]
const LARGE_PAGE: usize = 2 << 20;

/// Asks for a table to be held in large pages, from now on. It is a hint: whether it is followed shows in nothing but time. It costs
/// a copy of the table at most.
#[cfg(target_os = "linux")]
pub fn hold_in_large_pages<T>(table: &mut [T]) {
    let begin = table.as_mut_ptr() as usize;
    let end = begin + size_of_val(table);
    // Whole large pages alone: the hint takes whole pages, however large the system's are, and others gain nothing.
    let (first, last) = (begin.next_multiple_of(LARGE_PAGE), end / LARGE_PAGE * LARGE_PAGE);
    if first >= last {
        return;
    }
    let address: *mut libc::c_void = table.as_mut_ptr().cast::<u8>().wrapping_add(first - begin).cast();
    // Memory that was used before lies in small pages: the second hint puts it into large ones now (Linux 6.1).
    for advice in [libc::MADV_HUGEPAGE, libc::MADV_COLLAPSE] {
        // SAFETY: the range lies within the table, and these hints change neither what memory holds nor which may be accessed
        // (madvise(2)). An error means that there are no large pages, and nothing else.
        let _ = unsafe { libc::madvise(address, last - first, advice) };
    }
}

/// Here tables lie in pages of one size.
#[cfg(not(target_os = "linux"))]
pub fn hold_in_large_pages<T>(_table: &mut [T]) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_any_size_hold_what_they_held() {
        for n in [0, 1, 1000, 9 << 20] {
            let mut table: Vec<u8> = (0..n).map(|i: u32| (i % 251) as u8).collect();
            hold_in_large_pages(&mut table);
            assert!(table.iter().zip(0..n).all(|(&x, i)| u32::from(x) == i % 251), "{n}");
            hold_in_large_pages(&mut table[n as usize / 3..]);
            assert!(table.iter().zip(0..n).all(|(&x, i)| u32::from(x) == i % 251), "{n}");
        }
    }
}
