"""Commands about meshes of organs: made, examined, placed."""
