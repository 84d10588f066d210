"""The laboratory: experiments, each a command below `lixel lab`, and what they share."""
