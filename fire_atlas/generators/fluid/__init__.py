"""Fire simulated as a fluid: gas that burns, rises and swirls in a box of cubes."""
