"""What the page is shown, as frames: state, ranges, plan, map, history."""
