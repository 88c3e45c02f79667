//! Prints the JSON schema of an arm's TOML, as published in `assets/arm.schema.json`.

fn main() {
    print!("{}", supple_model::schema_json());
}
