//! The known word that an unknown one was probably meant to be.

/// The candidate nearest to `word`: the same but for case, or within one edit for each three letters, or one that
/// begins with the word or that the word begins with. The first of equals wins.
pub fn nearest<'a>(word: &str, candidates: impl Iterator<Item = &'a str> + Clone) -> Option<&'a str> {
    // A long word is no slip of the pen, and the table of distances must stay small.
    let n_chars = word.chars().count();
    if n_chars > 64 {
        return None;
    }
    let lower = word.to_lowercase();
    let close = candidates
        .clone()
        .map(|candidate| (edit_distance(&lower, &candidate.to_lowercase()), candidate))
        .filter(|&(distance, candidate)| distance <= n_chars.max(candidate.chars().count()).div_ceil(3).min(3))
        .filter(|&(distance, candidate)| distance < n_chars.min(candidate.chars().count()) || distance == 0)
        .min_by_key(|&(distance, _)| distance);
    let shares_a_beginning = |candidate: &&str| {
        let singular = lower.strip_suffix('s').unwrap_or(&lower);
        singular.len() >= 3
            && (candidate.starts_with(singular) || lower.starts_with(*candidate) && candidate.len() >= 3)
    };
    close.map(|(_, candidate)| candidate).or_else(|| candidates.clone().find(shares_a_beginning))
}

/// What to say to whoever wrote an unknown word: the nearest known one, or all of them.
pub fn advice<'a>(word: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match nearest(word, known.clone()) {
        Some(near) => format!("did you mean '{near}'?"),
        None => format!("expected one of {}", known.collect::<Vec<_>>().join(", ")),
    }
}

/// Insertions, deletions, substitutions and swaps of neighbours that lead from one word to the other (optimal string
/// alignment).
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut before: Vec<usize> = vec![0; b.len() + 1];
    let mut above: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let differs = usize::from(a[i - 1] != b[j - 1]);
            row[j] = (above[j] + 1).min(row[j - 1] + 1).min(above[j - 1] + differs);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut above, row);
    }
    above[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_of_the_pen_find_their_word_and_strangers_find_none() {
        let known = ["position", "radius", "light_source", "hittable", "k_d", "k_s", "A", "background"];
        let near = |word| nearest(word, known.iter().copied());
        assert_eq!(near("raduis"), Some("radius"));
        assert_eq!(near("Position"), Some("position"));
        assert_eq!(near("hittables"), Some("hittable"));
        assert_eq!(near("lights"), Some("light_source"));
        assert_eq!(near("back"), Some("background"));
        assert_eq!(near("a"), Some("A"));
        assert_eq!(near("kd"), Some("k_d"));
        assert_eq!(near("zzz"), None);
        assert_eq!(near(&"radius".repeat(1000)), None);
    }

    #[test]
    fn a_swap_of_neighbours_is_one_edit() {
        assert_eq!(edit_distance("raduis", "radius"), 1);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }
}
