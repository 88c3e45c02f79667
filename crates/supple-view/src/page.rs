//! The files of the page, embedded in the program. `page/build.sh` builds the bundle, which contains three.js and uPlot.

/// A file of the page.
#[derive(Clone, Copy, Debug)]
pub struct PageFile {
    /// Path in the URL after the token.
    pub name: &'static str,
    /// Media type.
    pub media_type: &'static str,
    /// Contents.
    pub bytes: &'static [u8],
}

/// All files of the page.
pub const FILES: [PageFile; 4] = [
    PageFile {
        name: "",
        media_type: "text/html; charset=utf-8",
        bytes: include_bytes!("../page/dist/index.html"),
    },
    PageFile {
        name: "page.js",
        media_type: "text/javascript; charset=utf-8",
        bytes: include_bytes!("../page/dist/page.js"),
    },
    PageFile {
        name: "page.css",
        media_type: "text/css; charset=utf-8",
        bytes: include_bytes!("../page/dist/page.css"),
    },
    PageFile {
        name: "licences.txt",
        media_type: "text/plain; charset=utf-8",
        bytes: include_bytes!("../page/dist/licences.txt"),
    },
];

#[cfg(test)]
mod tests {
    use super::FILES;

    #[test]
    fn the_page_is_smaller_than_2_mb_and_loads_nothing_from_other_servers() {
        let size: usize = FILES.iter().map(|file| file.bytes.len()).sum();
        assert!(size < 2_000_000, "{size} bytes");
        let index = String::from_utf8_lossy(FILES[0].bytes);
        assert!(
            !index.contains("http:") && !index.contains("https:"),
            "{index}"
        );
        assert!(
            !index.contains("<script>"),
            "the content security policy forbids inline scripts"
        );
    }
}
