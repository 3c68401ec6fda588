//! The C header of plugins says what the Rust definitions say.

use std::path::Path;

use cbindgen::{Builder, Config, DocumentationStyle, Language, Style};

/// The texts before and after the definitions.
const HEAD: &str = "\
/* The interface between longan and its plugins. Made from measures/src/plugin/interface.rs: do not edit it here.
 *
 * A plugin is a library that exports the two functions at the end of this file. Its code runs with the rights of whoever
 * runs longan. examples/plugin-c/axis_ratio.c is one; licensed under MIT or Apache-2.0.
 */
#ifndef LONGAN_PLUGIN_H
#define LONGAN_PLUGIN_H";
const TAIL: &str = "
// Before a function that a plugin exports.
#ifdef __cplusplus
#define LONGAN_LINKAGE extern \"C\"
#else
#define LONGAN_LINKAGE
#endif
#ifdef _WIN32
#define LONGAN_EXPORT LONGAN_LINKAGE __declspec(dllexport)
#else
#define LONGAN_EXPORT LONGAN_LINKAGE __attribute__((visibility(\"default\")))
#endif

// The two functions that a plugin defines: a LonganHandshake and a LonganDescribe.
LONGAN_EXPORT uint32_t longan_plugin_handshake(uint32_t interface_version, const char *host_version);
LONGAN_EXPORT const LonganPlugin *longan_plugin(char *message);

#endif
";

#[test]
fn the_header_is_current() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut config = Config {
        language: Language::C,
        style: Style::Both,
        documentation_style: DocumentationStyle::C99,
        header: Some(HEAD.to_owned()),
        trailer: Some(TAIL.to_owned()),
        no_includes: true,
        sys_includes: vec!["stddef.h".to_owned(), "stdint.h".to_owned()],
        usize_is_size_t: true,
        line_length: 100,
        ..Config::default()
    };
    let types = ["Complex", "Window", "Windows", "Measure", "Plugin", "Handshake", "Describe"];
    config.export.include = types.map(|name| format!("Longan{name}")).to_vec();
    let source = folder.join("src/plugin/interface.rs");
    let header = Builder::new().with_src(source).with_config(config).generate().unwrap();
    let mut made = Vec::new();
    header.write(&mut made);
    let path = folder.join("include/longan_plugin.h");
    if std::env::var_os("LONGAN_WRITE_HEADER").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    let current = std::fs::read(&path).unwrap() == made;
    assert!(
        current,
        "measures/include/longan_plugin.h is not current: run LONGAN_WRITE_HEADER=1 cargo test -p longan-measures"
    );
}
