"""How far roofs stand out beyond their walls, and solids with such roofs."""
