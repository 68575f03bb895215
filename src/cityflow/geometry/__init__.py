"""Maths on the values of core: polygons, planes, rays, solids, validity (ISO 19107)."""
