//! Prints the JSON schema of plant options, as published in `assets/plants/plant.schema.json`.

fn main() -> Result<(), serde_json::Error> {
    let schema = schemars::schema_for!(supple_plant::PlantOptions);
    println!("{}", serde_json::to_string_pretty(&schema)?);
    Ok(())
}
