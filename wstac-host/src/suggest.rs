//! The name that somebody meant, where another was given.

/// Most typos in a name that is still recognized.
const MOST_TYPOS: usize = 2;

/// Returns the name that is nearest to the one given, if it is near: at most two letters differ or have changed places,
/// and fewer than it has. Upper and lower case count as the same.
///
/// ```
/// use wstac_host::suggest::nearest;
///
/// assert_eq!(nearest("path-smv", ["path-svm", "svm"]), Some("path-svm"));
/// assert_eq!(nearest("saw3", ["Fla0", "Saw3"]), Some("Saw3"));
/// assert_eq!(nearest("forest", ["path-svm", "svm"]), None);
/// ```
pub fn nearest<'a>(given: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let given = given.to_lowercase();
    let typos = |name: &'a str| (strsim::osa_distance(&name.to_lowercase(), &given), name);
    let (typos, name) = names.into_iter().map(typos).min_by_key(|(typos, _)| *typos)?;
    (typos <= MOST_TYPOS && typos < given.chars().count()).then_some(name)
}
