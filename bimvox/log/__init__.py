"""What a log says (topics, plan, motions, scene), its MCAP container (``mcap``), and growing logs (``live``)."""
